// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/can/survey.hpp"

#include <algorithm>

namespace absenc::raa38::can {

namespace {

constexpr Time between_requests = 2ms;  // the request and one answer take 1 ms at 250 kbit/s
constexpr unsigned answering = 10;      // so many requests later a frame is no answer any more, but sent by itself
constexpr Time last_answers = 100ms;
constexpr Time entering_time = 20ms;  // nothing is answered to "enter configuration"
constexpr Time answer_window = 100ms;
constexpr Time switching_time = 50ms;  // until a controller is on the bus again with another bit rate
constexpr unsigned rate_attempts = 3;
constexpr auto most_clashes = 16;  // more numbers that are shared are a line on which nothing goes well

constexpr std::string_view alone = "connect this one alone: 7E5 reaches every node on the bus";

}  // namespace

// ---- Survey

Survey::Survey(const Format& format, bool listen_first)
    : format_(format), phase_(listen_first ? Phase::listening : Phase::asking) {
  if (listen_first) {
    listen(listening_time);
  } else {
    ask_next();
  }
}

void Survey::ask_next() {
  phase_ = Phase::asking;
  ask_for(encode_command(static_cast<std::uint8_t>(++asked_), command::read), between_requests);
}

void Survey::heard(const CanFrame& frame, Time at) {
  if (phase_ == Phase::done) return heard_then(frame, at);
  if (function_of(frame) != Function::reply) return;
  keep(frame, at);
  Heard& node = nodes_[node_of(frame)];
  const bool was_asked = phase_ == Phase::waiting || (node_of(frame) <= asked_ && node_of(frame) + answering > asked_);
  if (phase_ == Phase::listening && listened_from_ == never) listened_from_ = at;
  if (phase_ == Phase::listening && at - listened_from_ < 1s) ++node.per_second;
  if (phase_ == Phase::listening || !was_asked) {
    ++node.unasked;
  } else if (node.answers < 255) {
    ++node.answers;
  }
  const Result<std::uint32_t> counts = decode_position(format_, frame);
  node.readable = counts.has_value();
  node.counts = counts.value_or(0);
}

void Survey::over() {
  if (phase_ == Phase::done) return over_then();
  if (phase_ == Phase::waiting) {
    phase_ = Phase::done;
    return surveyed();
  }
  if (phase_ == Phase::asking && disturbed() && nodes_[asked_].damaged < 2) {
    if (++nodes_[asked_].damaged < 2) --asked_;  // once more
  }
  if (asked_ < 255) return ask_next();
  phase_ = Phase::waiting;
  listen(last_answers);
}

unsigned Survey::count() const {
  return static_cast<unsigned>(
      std::count_if(nodes_.begin(), nodes_.end(), [](const Heard& node) { return node.is_there(); }));
}

std::uint8_t Survey::first() const {
  for (unsigned node = 1; node < nodes_.size(); ++node) {
    if (nodes_[node].is_there()) return static_cast<std::uint8_t>(node);
  }
  return 0;
}

// ---- Scan, FindNode

void Scan::surveyed() {
  const auto damaged =
      std::count_if(nodes().begin(), nodes().end(), [](const Heard& node) { return node.damaged > 1; });
  if (damaged > most_clashes) return fail(Error::bad_framing);
  finish(count() == 0 ? Error::timeout : Error::none);
}

void Scan::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  for (unsigned number = 1; number < nodes().size(); ++number) {
    const Heard& node = nodes()[number];
    if (!node.is_there()) continue;
    put(sink, field_node, number);
    put(sink, field_clash, node.clash() ? 1 : 0);
    put(sink, field_readings_per_s, node.per_second);
    if (node.readable && !node.clash()) put_position(sink, format(), node.counts);
  }
}

void FindNode::surveyed() {
  if (count() == 0) return finish(Error::timeout, {"no node answers", {}});
  if (nodes()[format().node].is_there()) {
    node_ = format().node;
  } else if (count() == 1) {
    node_ = first();
  } else {
    return finish(Error::unexpected_reply, {"several nodes answer, but not this one", "`scan` shows which: set node="});
  }
  if (!nodes()[node_].clash()) return finish();
  finish(Error::bad_framing, {"two nodes share the number, or the line is bad", "connect the nodes one by one"});
}

void FindNode::report(FieldSink& sink) const {
  if (error() == Error::none) put(sink, field_node, node_);
}

// ---- Configure

Configure::Configure(const Format& format, std::uint8_t code, bool is_set)
    : Survey(format, true), code_(code), is_set_(is_set) {}

void Configure::surveyed() {
  const Heard& node = nodes()[format().node];
  if (count() == 0) return finish(Error::timeout, {"no node answers", {}});
  if (!node.is_there()) {
    return finish(Error::unexpected_reply, {"other nodes answer, but not this one", "`scan` shows which: set node="});
  }
  if (count() > 1) return finish(Error::invalid_argument, {"other nodes are on this bus", alone});
  if (node.clash()) {
    return finish(Error::invalid_argument, {"two nodes share the number, or the line is bad", alone});
  }
  if (is_set_) return finish();
  phase_ = Phase::entering;
  ask_for(encode_configuration(configuration::enter, 1), entering_time);
}

void Configure::heard_then(const CanFrame& frame, Time at) {
  if (phase_ == Phase::setting) {
    const Result<std::uint8_t> answer = decode_configuration_answer(code_, frame);
    if (!answer) return;
    keep(frame, at);
    if (*answer != 0) return fail(Error::request_rejected);
    answered_ = true;
    phase_ = Phase::verifying;
    verify();
  } else if (phase_ == Phase::verifying && is_from(frame, looked_for_)) {
    keep(frame, at);
    heard_position();
  }
}

void Configure::over_then() {
  switch (phase_) {
    case Phase::entering:
      phase_ = Phase::setting;
      written_ = true;
      return ask_for(setting(), answer_window);
    case Phase::setting:  // without an answer, but perhaps not without effect
      phase_ = Phase::verifying;
      return verify();
    case Phase::verifying:
      return nothing_heard();
  }
}

void Configure::look_for(std::uint8_t node) {
  looked_for_ = node;
  ask(encode_command(node, command::read));
}

void Configure::finish_verified() {
  verified_ = true;
  finish();
}

void Configure::report_configured(FieldSink& sink) const {
  if (error() != Error::none) return;
  put_setting(sink);
  put(sink, field_written, written_ ? 1 : 0);
  if (written_) put(sink, field_answered, answered_ ? 1 : 0);
}

void Configure::report_left(FieldSink& sink) const {
  if (written_ && !verified_) put_setting(sink);
}

// ---- SetNode

SetNode::SetNode(const Format& format, std::uint8_t node, bool force)
    : Configure(format, configuration::node, node == format.node && !force), node_(node) {}

void SetNode::heard_position() {
  if (old_) {
    return finish(
        Error::cross_check_failed,
        {found_ ? "it answers under its old number as well: another node was there" : "it keeps its old number",
         found_ ? "connect it alone and try again" : "switch its supply off and on, then `scan`"});
  }
  found_ = true;
  if (node_ == format().node) return finish_verified();
  old_ = true;
  look_for(format().node);
}

void SetNode::nothing_heard() {
  if (old_ && found_) return finish_verified();
  if (old_) {
    return finish(Error::timeout, {"it answers neither under its old number nor under the new one",
                                   "switch its supply off and on, then `scan`"});
  }
  if (node_ == format().node) return fail(missing());
  old_ = true;
  look_for(format().node);
}

void SetNode::report(FieldSink& sink) const { report_configured(sink); }

// ---- SetRate

SetRate::SetRate(const Format& format, std::int64_t bits_per_second, bool force)
    : Configure(format, configuration::rate, format.rate == bits_per_second && !force),
      rate_(rate_of_bits(bits_per_second)) {
  if (rate_ == nullptr) {
    finish(Error::invalid_argument, {"the document has no such bit rate", "give 1000000, 500000 or 250000"});
  }
}

void SetRate::verify() {
  place_ = Place::going;
  configure(rate_->bits_per_second, switching_time);
}

void SetRate::heard_position() {
  if (place_ == Place::there) return finish_verified();
  if (place_ == Place::going || place_ == Place::returning) return;
  finish(Error::cross_check_failed,
         {"it keeps its old bit rate", "switch its supply off and on, then try the new one"});
}

void SetRate::nothing_heard() {
  switch (place_) {
    case Place::going:
      place_ = Place::there;
      return look_for(format().node);
    case Place::there:
      if (++attempts_ < rate_attempts) return look_for(format().node);
      place_ = Place::returning;
      return configure(format().rate, switching_time);
    case Place::returning:
      place_ = Place::back;
      return look_for(format().node);
    case Place::back:
      return finish(Error::timeout, {"it answers neither at its old bit rate nor at the new one",
                                     "switch its supply off and on, then try both"});
  }
}

void SetRate::report(FieldSink& sink) const { report_configured(sink); }

}  // namespace absenc::raa38::can
