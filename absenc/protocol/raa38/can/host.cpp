// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/can/host.hpp"

#include <algorithm>

namespace absenc::raa38::can {

namespace {

constexpr Time between_looks = 10ms;  // two positions that far apart show whether the shaft turns
// To know how often a node sends, to 1 % where a carrier hands frames out some milliseconds late.
constexpr unsigned enough_frames = 4;
constexpr Time enough_time = 500ms;
// A window of its own, always to its end: a cyclic position may look like the answer.
constexpr Time command_window = answer_limit;

constexpr CanFrame request_of(const Format& format, Read::Way way) {
  return encode_command(format.node, way == Read::Way::start ? command::start : command::read);
}

}  // namespace

// ---- Read

Read::Read(const Format& format, Way way) : format_(format), way_(way) {
  if (way == Way::listen) {
    listen(listening_time);
  } else {
    ask(request_of(format, way));
  }
}

void Read::heard(const CanFrame& frame, Time at) {
  // Another device may use that identifier; but when nothing else comes it is what the user looks for.
  if (frame.extended && frame.id == encode_position(format_.node, 0).id) {
    keep(frame, at);
    only_extended_ = true;
  }
  if (!is_from(frame, format_.node)) return;
  keep(frame, at);
  const Result<std::uint32_t> counts = decode_position(format_, frame);
  if (!counts) return fail(counts.error());
  // Nothing tells when the node took the position: after it was asked, or some time before it sent it by itself.
  reading_ = {.singleturn = *counts,
              .singleturn_bits = format_.bits,
              .singleturn_valid_bits = format_.bits,
              .latched = way_ == Way::ask ? sent_at() : at,
              .received = at};
  finish();
}

void Read::over() {
  if (only_extended_ && !disturbed()) return fail(Error::unexpected_reply);
  if (way_ != Way::listen || disturbed()) return fail(missing());
  finish(Error::timeout,
         {"the node sends nothing by itself", "let it: `run <encoder> cyclic 10`, or ask it: listen=false"});
}

void Read::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put(sink, field_node, format_.node);
  put_position(sink, format_, static_cast<std::uint32_t>(reading_.singleturn));
}

// ---- SetCyclic

SetCyclic::SetCyclic(const Format& format, std::uint8_t readings_per_s) : format_(format), wanted_(readings_per_s) {
  ask_for(encode_command(format.node, command::cyclic, readings_per_s), command_window);
}

void SetCyclic::heard(const CanFrame& frame, Time at) {
  if (!is_from(frame, format_.node)) return;
  if (counting_) return cadence_.add(at);
  if (frame == encode_answer(format_.node, command::cyclic)) {
    answered_ = true;
    keep(frame, at);
  }
}

void SetCyclic::over() {
  if (!counting_) {
    counting_ = true;
    if (wanted_ == 0) return listen(listening_time);
    return listen(std::max(5 * slowest_period / wanted_ / 2, enough_time) + answer_limit);
  }
  if (wanted_ == 0 && cadence_.count == 0) return finish();
  if (wanted_ == 0) return finish(Error::cross_check_failed, {"the node goes on sending by itself", "try again"});
  if (cadence_.count == 0 && !answered_) return fail(missing());
  // By the number of frames: a carrier may hand them out in bunches.
  const unsigned rate = cadence_.per_second();
  if (cadence_.count >= 2 && 4 * rate >= 3 * wanted_ && 4 * rate <= 5 * wanted_ + 4u) return finish();
  finish(Error::cross_check_failed, {"the node sends more or fewer readings a second than it was told", {}});
}

void SetCyclic::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put(sink, field_node, format_.node);
  put(sink, field_readings_per_s, wanted_);
  put(sink, field_answered, answered_ ? 1 : 0);
}

// ---- Quietly

Quietly::Quietly(const Format& format) : format_(format) { listen(listening_time); }

std::int64_t Quietly::distance(std::uint32_t to, std::uint32_t from) const {
  const std::int64_t difference = wrapped_difference(to, from, format_.bits);
  return difference < 0 ? -difference : difference;
}

std::int64_t Quietly::noise() const { return std::max<std::int64_t>(1, (std::int64_t{1} << format_.bits) >> 14); }

void Quietly::ask_position(Time pause) {
  phase_ = Phase::reading;
  ask(encode_command(format_.node, command::read), pause);
}

void Quietly::ask_command(std::uint8_t code, std::uint8_t value) {
  phase_ = Phase::commanding;
  code_ = code;
  answered_ = false;
  ask_for(encode_command(format_.node, code, value), command_window);
}

void Quietly::heard(const CanFrame& frame, Time at) {
  if (!is_from(frame, format_.node)) return;
  switch (phase_) {
    case Phase::listening:
      cadence_.add(at);
      if (cadence_.count >= enough_frames && cadence_.last - cadence_.first >= enough_time) over();
      break;
    case Phase::checking:
    case Phase::resumed:
      heard_again_ = true;
      break;
    case Phase::reading: {
      keep(frame, at);
      const Result<std::uint32_t> counts = decode_position(format_, frame);
      if (!counts) return position_missing(counts.error());
      position(*counts);
      break;
    }
    case Phase::commanding:
      if (frame == encode_answer(format_.node, code_)) {
        answered_ = true;
        keep(frame, at);
      }
      break;
    case Phase::stopping:
    case Phase::resuming:
      break;
  }
}

void Quietly::over() {
  // Two of the periods that it had, and a little.
  const Time pause = cadence_.count < 2 ? listening_time : 2 * cadence_.period() + answer_limit;
  switch (phase_) {
    case Phase::listening:
      sends_ = cadence_.count != 0;
      if (!sends_) return work();
      phase_ = Phase::stopping;
      return ask_for(encode_command(format_.node, command::cyclic, 0), command_window);
    case Phase::stopping:
      phase_ = Phase::checking;
      return listen(pause);
    case Phase::checking:
      // A node that cannot be stopped is dealt with all the same: its positions count only after the answer's time.
      heard_again_ = false;
      return work();
    case Phase::reading:
      return position_missing(missing());
    case Phase::commanding:
      return command_over(answered_);
    case Phase::resuming:
      phase_ = Phase::resumed;
      return listen(pause);
    case Phase::resumed:
      if (!heard_again_ && outcome_ == Error::none) {
        return finish(Error::cross_check_failed,
                      {"it was done, but the node no longer sends by itself as it did before",
                       "let it: `run <encoder> cyclic 10`"});
      }
      return finish(outcome_, explanation_);
  }
}

void Quietly::position_missing(Error error) {
  fail(error);
  conclude(error, {detail(), advice()});
}

void Quietly::conclude(Error error, const Explanation& explanation) {
  outcome_ = error;
  explanation_ = explanation;
  if (!sends_) return finish(error, explanation);
  phase_ = Phase::resuming;
  const auto rate = static_cast<std::uint8_t>(cadence_.per_second());
  ask_for(encode_command(format_.node, command::cyclic, rate), command_window);
}

// ---- Zero

Zero::Zero(const Format& format) : Quietly(format) {}

void Zero::position(std::uint32_t counts) {
  constexpr std::uint32_t origin = 0;
  switch (looks_++) {
    case 0:
      before_ = counts;
      return ask_position(between_looks);
    case 1:
      if (distance(counts, before_) > noise()) {
        return conclude(Error::invalid_argument, {"the shaft turns: it must stand still", {}});
      }
      after_ = counts;
      if (distance(counts, origin) <= noise()) return conclude();
      written_ = true;
      return ask_command(command::zero, 0);
    default:
      break;
  }
  // 0.35 degrees; twice, in case that a late answer was taken for the position 32.
  const std::int64_t tolerance = std::max<std::int64_t>(1, (std::int64_t{1} << format().bits) >> 10);
  after_ = counts;
  if (distance(counts, origin) > tolerance) {
    return conclude(Error::cross_check_failed,
                    {answered_ ? "the node answered, but its position is not near 0 afterwards"
                               : "the node did not answer, and its position is not near 0 afterwards",
                     "the document only lets one guess that command 20 sets the zero: this node may not have it"});
  }
  if (looks_ < 4) return ask_position(between_looks);
  conclude();
}

void Zero::command_over(bool answered) {
  answered_ = answered;
  ask_position();
}

void Zero::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put(sink, field_node, format().node);
  put(sink, field_written, written_ ? 1 : 0);
  if (written_) put(sink, field_answered, answered_ ? 1 : 0);
  put(sink, field_before, before_);
  put(sink, field_after, after_);
}

// ---- SetDirection

SetDirection::SetDirection(const Format& format, bool negative)
    : Quietly(format), value_(negative ? format.negative : format.positive) {}

void SetDirection::position(std::uint32_t counts) {
  switch (looks_++) {
    case 0:
      before_ = counts;
      return ask_position(between_looks);
    case 1:
      if (distance(counts, before_) > noise()) {
        return conclude(Error::invalid_argument, {"the shaft turns: it must stand still", {}});
      }
      return ask_command(command::direction, value_);
    case 2:
      after_ = counts;
      return ask_position(between_looks);
    default:
      break;
  }
  const auto mirror = static_cast<std::uint32_t>((0 - before_) & low_mask(format().bits));
  const bool same = distance(counts, before_) <= 2 * noise();
  mirrored_ = !same && distance(counts, mirror) <= 2 * noise();
  if (distance(counts, after_) > noise() || (!same && !mirrored_)) {
    return conclude(Error::cross_check_failed,
                    {"the position afterwards is neither the one before nor its mirror image",
                     "turn the shaft and see which way the node counts"});
  }
  if (!answered_ && same) {
    return conclude(Error::timeout, {"the node did not answer the command, and its position is the same", {}});
  }
  conclude();
}

void SetDirection::command_over(bool answered) {
  answered_ = answered;
  ask_position();
}

void SetDirection::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put(sink, field_node, format().node);
  put(sink, field_value, value_);
  put(sink, field_answered, answered_ ? 1 : 0);
  put(sink, field_mirrored, mirrored_ ? 1 : 0);
  put(sink, field_before, before_);
  put(sink, field_after, after_);
}

}  // namespace absenc::raa38::can
