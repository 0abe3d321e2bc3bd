// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/serial/host.hpp"

#include <algorithm>
#include <utility>

#include "absenc/protocol/raa38/serial/fields.hpp"

namespace absenc::raa38::serial {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

namespace {

constexpr unsigned scan_attempts = 2;
constexpr std::string_view two_at_once = "two encoders with one number, or a bad line";

// What is wrong with a reply, and what to do where the error alone does not tell.
Explanation explanation(const Settings& settings, Error error) {
  switch (error) {
    case Error::wrong_length:
      return {"the frame has another number of bytes than the option bits makes", "check bits and baud"};
    case Error::bad_checksum:
      if (settings.mode != Mode::bus) return {};
      return {two_at_once, "`scan` shows who answers; check numbers, termination and baud"};
    case Error::unexpected_reply:
      if (settings.mode != Mode::bus) return {"it is no frame: FF 81 is missing", "check mode, baud and second_byte"};
      return {"another unit answered, or no frame came", "check unit and second_byte; `scan` shows who answers"};
    case Error::out_of_range:
      return {"the position has more bits than the option bits says", "set bits"};
    case Error::timeout:
      if (settings.mode == Mode::bus) return {{}, "`scan` shows who answers; check supply, A/B polarity and baud"};
      return {"no frame followed the pulse", "check the wire to CLK, its level, the pulse's width, supply and baud"};
    default:
      return {};
  }
}

}  // namespace

// ---- Reader

Reader::Reader(const Settings& settings)
    : settings_(settings), decoder_(settings.format, settings.second_byte(), settings.period) {}

void Reader::ask(Time earliest, std::uint8_t unit) {
  doing_ = Doing::asking;
  earliest_ = earliest;
  unit_ = unit;
}

void Reader::clear() { doing_ = Doing::to_clear; }

void Reader::finish(Error error, std::string_view detail, std::string_view advice) {
  doing_ = Doing::done;
  error_ = error;
  const Explanation more = is_noisy() ? noise_.explanation() : explanation(settings_, error);
  detail_ = detail.empty() ? more.found : detail;
  advice_ = advice.empty() && detail.empty() ? more.advice : advice;
}

ByteStep Reader::next(Time now) {
  if (doing_ == Doing::listening && now >= deadline_) end_listening(now);  // bytes may come before every timer
  switch (doing_) {
    case Doing::asking:
      if (wait_first_ > Time{}) earliest_ = now + std::exchange(wait_first_, Time{});
      return now < earliest_ ? ByteStep{.at = earliest_} : ask_step(now);
    case Doing::to_clear:
      return clear_step();
    case Doing::done:
      return {.kind = ByteStep::Kind::done};
    default:
      return wait_step();
  }
}

ByteStep Reader::ask_step(Time now) {
  frame_.clear();
  sent_.clear();
  disturbed_ = heard_ = false;
  noise_.clear();
  found_ = Error::none;
  if (settings_.mode == Mode::timing) {
    doing_ = Doing::listening;
    deadline_ = now + std::max(listen_limit, 4 * settings_.period);
    sent_at_ = received_at_ = now;
    return wait_step();
  }
  doing_ = Doing::sending;
  ByteStep step = wait_step();
  if (settings_.mode == Mode::handshake) {
    step.kind = ByteStep::Kind::pulse;
    step.line = Line::trigger;
    step.width = trigger_width;
    return step;
  }
  sent_ = encode_request({Request::Kind::read, unit_});
  step.kind = ByteStep::Kind::transfer;
  step.out = sent_.view();
  return step;
}

ByteStep Reader::clear_step() {
  doing_ = Doing::clearing;
  if (settings_.zeroing == Zeroing::line) {
    return {.kind = ByteStep::Kind::pulse, .width = clear_width, .line = Line::clear};
  }
  sent_ = encode_request({Request::Kind::zero_clear, settings_.zero_unit});
  return {.kind = ByteStep::Kind::transfer, .out = sent_.view()};
}

ByteStep Reader::wait_step() const {
  if (doing_ == Doing::listening) return {.at = deadline_};
  if (doing_ == Doing::clearing) return {};
  const Time answer = settings_.acquisition > Time{} ? settings_.acquisition + answer_slack : answer_limit;
  const Time gap = std::max(settings_.transmission, gap_limit);
  const std::size_t size = settings_.format.frame_bytes();
  const std::size_t due = doing_ == Doing::settling ? 0 : size - std::min(size, frame_.size());
  return {.expect = due, .answer = doing_ == Doing::settling ? gap : answer, .gap = gap};
}

void Reader::feed(const ByteEvent& event) {
  switch (event.kind) {
    case ByteEvent::Kind::sent:
      return sent(event.at);
    case ByteEvent::Kind::received:
      return received(event.items, event.at);
    case ByteEvent::Kind::line_error:
      disturbed_ = heard_ = true;
      if (doing_ == Doing::listening) decoder_.disturbed([](const Found&) {});
      if (doing_ == Doing::receiving) {
        doing_ = Doing::settling;
        found_ = Error::bad_framing;
      }
      noise_.heard(event.at);
      return end_noise();
    case ByteEvent::Kind::silence:
      return silence();
    default:
      return;
  }
}

void Reader::sent(Time at) {
  sent_at_ = received_at_ = at;
  if (doing_ == Doing::clearing) return cleared();
  if (doing_ != Doing::sending) return;
  const bool pulsed = settings_.mode == Mode::handshake;
  latched_at_ = pulsed ? at - trigger_width : at;
  doing_ = Doing::receiving;
  if (disturbed_) {
    doing_ = Doing::settling;
    found_ = Error::unexpected_reply;
  } else if (!frame_.empty()) {
    check_frame();  // T3 was shorter than the pulse
  }
}

void Reader::received(Bytes bytes, Time at) {
  if (doing_ == Doing::listening) return listen(bytes, at);
  if (doing_ == Doing::asking) return unasked();
  if (doing_ != Doing::sending && doing_ != Doing::receiving && doing_ != Doing::settling) return;
  heard_ = true;
  noise_.heard(at);
  received_at_ = at;
  if (doing_ == Doing::sending && settings_.mode != Mode::handshake) disturbed_ = true;
  const std::size_t room = frame_.capacity() - frame_.size();
  frame_.append(bytes.first(std::min(bytes.size(), room)));
  if (doing_ == Doing::receiving) check_frame();
  end_noise();
}

void Reader::check_frame() {
  if (frame_.size() < settings_.format.frame_bytes()) return;
  const int whose = settings_.mode == Mode::bus ? unit_ : anybody;
  const Result<Position> position = decode_position(settings_.format, frame_, whose);
  if (position) return got(*position);
  found_ = position.error();
  doing_ = Doing::settling;
}

// The newest frame of what has come.
void Reader::listen(Bytes bytes, Time at) {
  heard_ = true;
  bool found = false;
  Position position{.second_byte = settings_.second_byte()};
  decoder_.feed(bytes, at, [&](const Found& frame) {
    if (frame.error != Error::none) return;
    found = true;
    position.singleturn = frame.singleturn;
  });
  if (!found) return;
  received_at_ = latched_at_ = at;
  frame_.clear();
  frame_.append(encode_position(settings_.format, position));
  got(position);
}

void Reader::silence() {
  if (doing_ == Doing::receiving) {
    failed(frame_.empty() ? Error::timeout : Error::wrong_length);
  } else if (doing_ == Doing::settling) {
    const bool longer = frame_.size() > settings_.format.frame_bytes();
    failed(longer && found_ != Error::bad_framing ? Error::wrong_length : found_);
  }
}

void Reader::end_noise() {
  if (doing_ != Doing::receiving && doing_ != Doing::settling) return;
  if (is_noisy()) failed(Error::wrong_length);
}

void Reader::end_listening(Time now) {
  received_at_ = now;
  if (!heard_) return failed(Error::timeout);
  failed(decoder_.saw_larger_positions() ? Error::out_of_range : Error::bad_framing);
}

// ---- ReadPosition

ReadPosition::ReadPosition(const Settings& settings) : Reader(settings) { ask({}, settings.unit); }

void ReadPosition::got(const Position& position) {
  const Position first = position_;
  position_ = position;
  reading_ = to_reading(settings().format, position, latched_at(), received_at());
  if (settings().maximum_rpm == 0) return finish();
  if (!has_first_) {
    has_first_ = true;
    first_at_ = latched_at();
    return ask({}, settings().unit);
  }
  if (is_possible(settings(), first.singleturn, position.singleturn, received_at() - first_at_)) return finish();
  finish(Error::cross_check_failed, "two positions in a row are farther apart than max_rpm allows",
         "the checksum does not see swapped bytes: read again, and check shielding, bits and max_rpm");
}

void ReadPosition::failed(Error error) { finish(error); }

const Reading* ReadPosition::reading() const {
  return error() == Error::none && reading_.singleturn_bits != 0 ? &reading_ : nullptr;
}

void ReadPosition::report(FieldSink& sink) const {
  if (reading() != nullptr) put_position(sink, settings().format, position_);
}

// ---- Zero

Zero::Zero(const Settings& settings) : Reader(settings) {
  if (settings.zeroing == Zeroing::none) {
    finish(Error::unsupported, "nothing is known of a way to set the zero of this encoder",
           "an encoder that was ordered with zero clearing: zeroing=line (a wire to CLR) or zeroing=command (a bus)");
  } else if (settings.zeroing == Zeroing::command && settings.mode != Mode::bus) {
    finish(Error::invalid_argument, "BC AA Cx is a command of a bus",
           "set mode=bus, or zeroing=line for a wire to CLR");
  } else {
    ask({}, settings.unit);
  }
}

void Zero::got(const Position& position) {
  position_ = position;
  if (!is_set_) {
    before_ = position;
    return clear();
  }
  const std::int64_t off = wrapped_difference(position.singleturn, 0, settings().format.bits);
  const std::int64_t allowed = (std::int64_t{1} << settings().format.bits) / 1024;
  if (std::max(off, -off) <= allowed) return finish();
  if (may_try_again()) return ask(received_at() + zero_poll, settings().unit);
  finish(Error::cross_check_failed, "the position is not zero after the zero was set",
         "let the shaft stand still; check the wire to CLR (below 0.5 V), or zero_unit, and that the encoder has it");
}

void Zero::cleared() {
  is_set_ = true;
  give_up_at_ = received_at() + zero_limit;
  ask(received_at() + zero_poll, settings().unit);
}

void Zero::failed(Error error) {
  if (is_set_ && may_try_again()) return ask(received_at() + zero_poll, settings().unit);
  if (!is_set_) return finish(error);
  finish(error, "the zero was set, but the position could not be read back", "read the encoder to see what it is now");
}

void Zero::report(FieldSink& sink) const {
  if (error() != Error::none || !is_set_) return;
  put(sink, field_before, before_.singleturn);
  put_position(sink, settings().format, position_);
}

// ---- Scan

Scan::Scan(const Settings& settings)
    : Reader([&] {
        Settings bus = settings;
        bus.mode = Mode::bus;
        return bus;
      }()) {
  wait_first(scan_silence);
  ask({}, 0);
}

void Scan::unasked() {
  if (unit_ != 0 || attempt_ != 1) return;  // a late answer
  finish(Error::unexpected_reply, "something comes although nobody asks",
         "an encoder that transmits by itself has no number: mode=timing, and nothing to scan for");
}

void Scan::got(const Position& position) {
  answering_ = static_cast<std::uint16_t>(answering_ | 1u << unit_);
  positions_[unit_] = position;
  go_on();
}

void Scan::failed(Error error) {
  if (is_noisy()) return finish(error);
  if (error != Error::timeout) {
    if (attempt_++ < scan_attempts) return ask({}, static_cast<std::uint8_t>(unit_));
    disturbed_ = static_cast<std::uint16_t>(disturbed_ | 1u << unit_);
  }
  go_on();
}

void Scan::go_on() {
  attempt_ = 1;
  if (++unit_ < unit_count) return ask({}, static_cast<std::uint8_t>(unit_));
  if (answering_ == 0 && disturbed_ == 0) {
    return finish(Error::timeout, "no number from 0 to F is answered",
                  "check supply, A/B polarity and baud, and that the encoder is one with bus commands");
  }
  finish();
}

void Scan::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  for (unsigned unit = 0; unit < unit_count; ++unit) {
    const bool answers = (answering_ >> unit & 1) != 0;
    if (!answers && (disturbed_ >> unit & 1) == 0) continue;
    put(sink, field_encoder_address, unit);
    put(sink, field_clash, answers ? 0 : 1);
    if (answers) put_position(sink, settings().format, positions_[unit]);
  }
}

}  // namespace absenc::raa38::serial
