// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/e201/host.hpp"

#include "absenc/protocol/e201/fields.hpp"

namespace absenc::e201 {

namespace {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

constexpr std::array info_letters{command::version, command::serial, command::supply, command::clock};
constexpr unsigned supplied_above = 1000;  // mV

constexpr std::string_view needs_firmware = "reading by `4` needs firmware 1.16 of the interface";
constexpr std::string_view check_firmware = "`info` shows which firmware it has";
constexpr std::string_view check_clocks = "read it and set it with clock and set-clock";

// Whether a line may be the answer to this command.
Error judge(std::uint8_t letter, Bytes line) {
  struct Nowhere final : FieldSink {
    void put(const FieldValue&) override {}
  } nowhere;
  return detail::decode_line(letter, line, nowhere);
}

}  // namespace

void Procedure::ask(const RequestText& request, Answer answer, Time earliest) {
  request_ = request;
  answer_ = answer;
  earliest_ = earliest;
  state_ = State::ready;
}

void Procedure::finish(Error error, const Explanation& explanation) {
  error_ = error;
  explanation_ = explanation;
  state_ = State::done;
}

ByteStep Procedure::next(Time) {
  if (emitting_) {
    emitting_ = false;
    return {.kind = ByteStep::Kind::emit};
  }
  ByteStep step{.at = never, .answer = answer_ == Answer::unknown ? silent_limit : answer_limit, .gap = gap_limit};
  if (answer_ == Answer::samples && state_ == State::receiving) step.expect = samples_length - reply_.size();
  switch (state_) {
    case State::ready:
      begin_request();
      reply_.clear();
      step.kind = ByteStep::Kind::transfer;
      step.out = request_;
      step.expect = answer_ == Answer::samples ? samples_length : 0;
      step.at = earliest_;
      break;
    case State::sending:
      break;
    case State::receiving:
    case State::settling:
      break;
    case State::ending:
    case State::done:
      step.kind = ByteStep::Kind::done;
      break;
  }
  return step;
}

void Procedure::received(Bytes bytes) {
  for (const std::uint8_t byte : bytes) {
    const bool line_feed = answer_ == Answer::line && byte == '\n' && reply_.empty();  // of the reply before
    if (!line_feed) reply_.push_back(byte);
  }
  if (state_ != State::receiving || answer_ == Answer::unknown) return;
  if (answer_ == Answer::samples) {
    if (reply_.size() < samples_length) return;
    // Anything else may still be going on: what comes of it must not meet the next request.
    if (reply_.size() > samples_length || reply_[samples_length - 1] != end_of_line) {
      state_ = State::settling;
      return;
    }
    return answered(reply_);
  }
  std::size_t length = reply_.size();
  while (length > 1 && reply_[length - 1] == '\n') --length;  // a LF may follow the CR
  if (length > 0 && reply_[length - 1] == end_of_line) answered(reply_.view().first(length));
}

void Procedure::conclude() {
  if (disturbed_) return failed(reply_.empty() ? Error::bad_framing : Error::wrong_length);
  if (answer_ == Answer::unknown && !is_noisy()) return answered(reply_);
  failed(reply_.empty() ? Error::timeout : Error::wrong_length);
}

Exchange<std::uint8_t> Procedure::exchange() const { return {request_, reply_, sent_at_, received_at_}; }

// ---- ReadPosition

ReadPosition::ReadPosition(const Format& format) : format_(format) {
  ask(encode_request(command::samples), Answer::samples);
}

void ReadPosition::answered(Bytes reply) {
  if (phase_ == Phase::version) {
    const std::optional<Version> version = find_version(reply);
    if (version && !has_samples(*version)) return finish(Error::unsupported, {needs_firmware, check_firmware});
    phase_ = Phase::again;
    return ask(encode_request(command::samples), Answer::samples);
  }
  const Result<Position> position = decode_position(format_, reply);
  if (!position) return finish(position.error(), explain_reply(position.error(), format_));
  position_ = *position;
  reading_ = to_reading(format_.word(), position_.word, format_.scale());
  reading_.latched = sent_at();  // clocking begins when the command is there
  reading_.received = received_at();
  good_ = true;
  finish();
}

void ReadPosition::failed(Error error) {
  if (phase_ == Phase::version) {
    if (failure_ == Error::timeout) return finish(failure_, explain_reply(failure_));
    return finish(failure_, explain(format_, failure_, command::samples, {}));
  }
  if (phase_ == Phase::again && error == Error::timeout) {
    return finish(error, {"the interface answers `v` but not `4`", check_firmware});
  }
  if (phase_ == Phase::again || error == Error::bad_framing) return finish(error, explain_reply(error, format_));
  failure_ = error;
  phase_ = Phase::version;
  ask(encode_request(command::version), Answer::line);
}

const Reading* ReadPosition::reading() const { return good_ ? &reading_ : nullptr; }

void ReadPosition::report(FieldSink& sink) const {
  if (good_) put_position(sink, format_, position_);
}

// ---- Query, Info

Query::Query(std::uint8_t letter) : letter_(letter) { ask(encode_request(letter), Answer::line); }

void Query::answered(Bytes reply) {
  line_.append(reply);
  const Error error = judge(letter_, line_);
  finish(error, explain_reply(error));
}

void Query::report(FieldSink& sink) const {
  if (error() == Error::none && !line_.empty()) static_cast<void>(detail::decode_line(letter_, line_, sink));
}

Info::Info() { ask(encode_request(info_letters[0]), Answer::line); }

void Info::answered(Bytes reply) {
  const Error error = judge(info_letters[index_], reply);
  if (index_ == 0 && error != Error::none) return failed(error);
  lines_[index_].append(reply);
  go_on();
}

void Info::failed(Error error) {
  if (index_ == 0 || is_noisy()) return finish(error, explain_reply(error));
  go_on();
}

void Info::go_on() {
  if (++index_ == info_letters.size()) return finish();
  ask(encode_request(info_letters[index_]), Answer::line);
}

void Info::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    if (!lines_[i].empty()) static_cast<void>(detail::decode_line(info_letters[i], lines_[i], sink));
  }
}

// ---- Set, SwitchSupply, Tell

Set::Set(std::uint8_t letter, unsigned value) : letter_(letter), value_(value) {
  ask(encode_request(letter, value), Answer::unknown);
}

void Set::answered(Bytes reply) {
  const bool clock = letter_ == command::set_clock;
  if (!verifying_) {
    verifying_ = true;
    return ask(encode_request(clock ? command::clock : command::width), Answer::line);
  }
  const std::optional<unsigned> found = clock ? find_clock(reply) : find_number(reply);
  if (!found) return finish(Error::bad_framing, explain_reply(Error::bad_framing));
  if (*found == value_) return finish();
  finish(Error::cross_check_failed, {"the interface has another setting than it was given", {}});
}

void Set::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  if (letter_ == command::set_clock) {
    put_clock(sink, value_);
  } else {
    put(sink, field_width, value_);
  }
}

SwitchSupply::SwitchSupply(bool on) : on_(on) {
  ask(encode_request(on ? command::supply_on : command::supply_off), Answer::unknown);
}

void SwitchSupply::answered(Bytes reply) {
  if (!verifying_) {
    verifying_ = true;
    return ask(encode_request(command::supply), Answer::line, sent_at() + supply_time);
  }
  line_.append(reply);
  const std::optional<unsigned> voltage = find_milli(line_, 'V');
  const bool wrong = voltage && (*voltage > supplied_above) != on_;
  if (!wrong) return finish();
  finish(Error::cross_check_failed, {"the voltage that the interface shows contradicts it", "look at it with `info`"});
}

void SwitchSupply::report(FieldSink& sink) const {
  if (error() == Error::none) put_supply(sink, line_);
}

Tell::Tell(std::uint8_t letter) : request_(encode_request(letter)) { ask(request_, Answer::unknown); }

void Tell::report(FieldSink& sink) const {
  if (error() == Error::none) put_text(sink, field_command, request_);
}

// ---- Zero

Zero::Zero(const Format& format) {
  const unsigned bits = format.word().bits_of(Meaning::position);
  noise_ = bits > 14 ? std::int64_t{1} << (bits - 14) : 1;  // 0.02 degrees
  ask(encode_request(command::decimal), Answer::line);
}

void Zero::answered(Bytes reply) {
  if (phase_ == Phase::zero) {
    phase_ = Phase::verify;
    return ask(encode_request(command::decimal), Answer::line);
  }
  const Result<std::int64_t> counts = decode_number(reply, 10);
  if (!counts) return finish(counts.error(), explain_reply(counts.error()));
  const std::int64_t before = counts_;
  counts_ = *counts;
  switch (phase_) {
    case Phase::first_look:
      phase_ = Phase::second_look;
      return ask(encode_request(command::decimal), Answer::line, received_at() + between_looks);
    case Phase::second_look:
      if (!is_near(counts_ - before)) {
        return finish(Error::invalid_argument, {"the encoder moves: it must stand still", {}});
      }
      phase_ = Phase::zero;
      return ask(encode_request(command::zero), Answer::unknown);
    default:
      break;
  }
  if (is_near(counts_)) return finish();
  finish(Error::cross_check_failed, {"the position is not zero afterwards", {}});
}

void Zero::report(FieldSink& sink) const {
  if (error() == Error::none) put(sink, field_number, counts_);
}

// ---- ClockSweep

ClockSweep::ClockSweep(const Format& format, unsigned frames) : format_(format), frames_(frames) {
  ask(encode_request(command::version), Answer::line);
}

void ClockSweep::answered(Bytes reply) {
  switch (phase_) {
    case Phase::version: {
      const std::optional<Version> version = find_version(reply);
      if (version && !has_samples(*version)) return finish(Error::unsupported, {needs_firmware, check_firmware});
      phase_ = Phase::previous;
      return ask(encode_request(command::clock), Answer::line);
    }
    case Phase::previous:
      if (!find_clock(reply)) return finish(Error::bad_framing, {"the interface does not say which clock it has", {}});
      previous_ = *find_clock(reply);
      return next_clock();
    case Phase::set:
      phase_ = Phase::check;
      return ask(encode_request(command::clock), Answer::line);
    case Phase::check:
      if (find_clock(reply) != clock_) {
        return restore(Error::cross_check_failed, {"the interface has another clock than it was given", {}});
      }
      phase_ = Phase::frames;
      return ask(encode_request(command::samples), Answer::samples);
    case Phase::frames:
      return count(decode_position(format_, reply).error());
    case Phase::restore:
      phase_ = Phase::verify;
      return ask(encode_request(command::clock), Answer::line);
    case Phase::verify:
      if (find_clock(reply) == previous_) return finish(outcome_, outcome_explanation_);
      return finish(Error::cross_check_failed, {"the clock that was set before could not be restored", check_clocks});
  }
}

void ClockSweep::failed(Error error) {
  if (phase_ == Phase::frames && !is_noisy()) return count(error);
  if (previous_ == 0) return finish(error, explain_reply(error));
  if (phase_ == Phase::restore || phase_ == Phase::verify) {
    return finish(error, {"it is not known whether the clock that was set before is restored", check_clocks});
  }
  restore(error, explain_reply(error));
}

void ClockSweep::next_clock() {
  if (clock_ == clocks_khz.size() || aborted_) {
    const bool none = recommended() == 0 && !aborted_;
    if (!none) return restore(Error::none, {});
    return restore(last_error_, {"no MA clock gave good frames only", last_advice_});
  }
  ++clock_;
  read_ = 0;
  phase_ = Phase::set;
  ask(encode_request(command::set_clock, clock_), Answer::unknown);
}

void ClockSweep::count(Error error) {
  ++read_;
  if (error == Error::none) {
    ++valid_[clock_ - 1];
  } else {
    last_error_ = error;
    last_advice_ = explain_reply(error, format_).advice;
  }
  if (aborted_) return next_clock();
  if (read_ < frames_) return ask(encode_request(command::samples), Answer::samples);
  ++measured_;
  emit();
  next_clock();
}

void ClockSweep::restore(Error error, const Explanation& explanation) {
  outcome_ = error;
  outcome_explanation_ = explanation;
  phase_ = Phase::restore;
  ask(encode_request(command::set_clock, previous_), Answer::unknown);
}

unsigned ClockSweep::recommended() const {
  unsigned best = 0;
  unsigned longest = 0;
  for (unsigned first = 0; first < valid_.size(); ++first) {
    unsigned end = first;
    while (end < valid_.size() && valid_[end] == frames_) ++end;
    if (end - first <= longest) continue;
    longest = end - first;
    best = first + longest / 2 + 1;
  }
  return best;
}

void ClockSweep::report(FieldSink& sink) const {
  if (error() != Error::none || previous_ == 0) return;
  put(sink, field_frames, frames_);
  for (unsigned i = 0; i < measured_; ++i) put(sink, static_cast<FieldIndex>(field_valid + i), valid_[i]);
  if (phase_ != Phase::verify) return;
  if (!aborted_ && recommended() != 0) {
    put(sink, field_recommended, recommended());
    put(sink, field_recommended_khz, clocks_khz[recommended() - 1]);
  }
  put(sink, field_restored, previous_);
  put(sink, field_aborted, aborted_ ? 1 : 0);
}

void ClockSweep::report_left(FieldSink& sink) const {
  if (clock_ == 0) return;
  const unsigned left = phase_ == Phase::restore || phase_ == Phase::verify ? previous_ : clock_;
  put(sink, field_left, left);
  put(sink, field_left_khz, clocks_khz[left - 1]);
  put(sink, field_previous, previous_);
}

}  // namespace absenc::e201
