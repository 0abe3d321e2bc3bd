// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/host.hpp"

#include <algorithm>

#include "absenc/protocol/encolink/fields.hpp"

namespace absenc::encolink {

namespace {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

constexpr unsigned cycle_attempts = 3;
constexpr unsigned access_attempts = 5;  // each is some hundred frames, all of which must be good

constexpr std::string_view no_channel2 = "without channel 2 (has_ch2=false) there is neither status nor register";
constexpr std::string_view disagreement =
    "channel 2 has another position than channel 1: positions go on, but the detailed status cannot be trusted";

}  // namespace

Stream::Stream(const Format& format, Wire wire, unsigned attempts)
    : format_(format), wire_(wire), attempts_(attempts), frame_attempts_left_(attempts) {
  state_ = State::ready;
}

void Stream::reset_channels() {
  if (!format_.has_ch2) return finish(Error::unsupported, no_channel2);
  uses_channel2_ = reset_pending_ = true;
}

void Stream::submit(const RegisterRequest& request) {
  if (!format_.has_ch2) return finish(Error::unsupported, no_channel2);
  if (protocol_version_ == 0) identify();
  if (protocol_version_ == version::aksim4) return finish(Error::unsupported, not_described);
  access_.start(request);
  access_attempts_left_ = access_attempts - 1;
  uses_channel2_ = true;
  if (!cycle_.in_step()) reset_pending_ = true;
}

void Stream::identify() { identify_pending_ = true; }

void Stream::finish(Error error, std::string_view detail) {
  error_ = error;
  detail_ = detail;
  state_ = State::done;
}

const Reading* Stream::reading() const { return error_ == Error::none && frames_ > 0 ? &reading_ : nullptr; }

Exchange<std::uint8_t> Stream::exchange() const { return {request_, reply_, sent_at_, received_at_}; }

// ---- Frames

ByteStep Stream::next(Time now) {
  if (emit_pending_) {
    emit_pending_ = false;
    return {.kind = ByteStep::Kind::emit};
  }
  ByteStep step{.at = never, .answer = answer_limit, .gap = gap_limit};
  switch (state_) {
    case State::ready:
      begin_frame(now);
      step.kind = ByteStep::Kind::transfer;
      step.out = request_;
      step.expect = expected();
      step.at = earliest_;
      break;
    case State::sending:
      step.expect = expected();
      break;
    case State::receiving:
      step.expect = expected() > reply_.size() ? expected() - reply_.size() : 0;
      break;
    case State::settling:
      break;
    case State::ending:
    case State::done:
      step.kind = ByteStep::Kind::done;
      break;
  }
  return step;
}

void Stream::begin_frame(Time now) {
  begin_request();
  reply_.clear();
  began_at_ = std::max(now, earliest_);
  Config config = Config::position;
  std::uint8_t ra = 0;
  if (asked_ == Asked::identity) {  // its request is an ordinary one
  } else if (identify_pending_ || !format_.known()) {
    asked_ = Asked::to_identify;
    config = Config::identify;
  } else if (reset_pending_) {
    asked_ = Asked::reset;
    config = Config::reset_channels;
  } else {
    asked_ = Asked::position;
    ra = access_.next_byte(began_at_);
  }
  request_ = {static_cast<std::uint8_t>(config), ra};
}

// 0: silence ends it. What comes before the identity has a length that may be unknown, and behind both there may be
// more.
std::size_t Stream::expected() const {
  const bool identifies = asked_ == Asked::to_identify || asked_ == Asked::identity;
  if (identifies) return wire_ == Wire::spi ? identity_bytes : 0;
  return format_.frame_bytes();
}

void Stream::received(Bytes bytes) {
  for (const std::uint8_t byte : bytes) reply_.push_back(byte);
  const std::size_t wanted = expected();
  if (state_ != State::receiving || wanted == 0 || reply_.size() < wanted) return;
  // After a wrong reply more may be coming: the next request waits for silence. SPI has brought all there is.
  if (check() == Error::none || wire_ == Wire::spi) {
    conclude();
  } else {
    state_ = State::settling;
  }
}

void Stream::conclude() {
  Error error = Error::wrong_length;  // disturbed: bytes that are not this reply's
  if (reply_.empty()) {
    error = disturbed_ ? Error::bad_framing : Error::timeout;
  } else if (!disturbed_ && !is_noisy()) {
    error = check();
  }
  state_ = State::ready;
  earliest_ = wire_ == Wire::spi ? received_at_ + spi_pause : Time{};
  if (error == Error::none) {
    good_frame();
  } else {
    bad_frame(error);
  }
}

bool Stream::is_stuck() const {
  const Bytes bytes = reply_;
  return wire_ == Wire::spi && (bytes[0] == 0x00 || bytes[0] == 0xFF) &&
         std::all_of(bytes.begin(), bytes.end(), [&](std::uint8_t byte) { return byte == bytes[0]; });
}

Error Stream::check() {
  if (is_stuck()) return Error::line_stuck;
  if (asked_ == Asked::identity) return decode_identity(reply_).error();
  if (asked_ == Asked::to_identify) return Error::none;
  return decode_position(format_, reply_).error();
}

void Stream::good_frame() {
  if (asked_ == Asked::identity) return good_identity();
  if (asked_ == Asked::to_identify) {
    asked_ = Asked::identity;
    return;
  }
  frame_attempts_left_ = attempts_;
  good_position();
}

void Stream::good_identity() {
  const Identity identity = *decode_identity(reply_);
  frame_attempts_left_ = attempts_;
  asked_ = Asked::position;
  identify_pending_ = false;
  cycle_.lose_step();  // asking for it has reset the channels
  protocol_version_ = identity.protocol_version;
  const Result<Format> known = trusts_identity_ ? as_identified(format_, identity) : complete(format_, identity);
  if (!known) {
    return finish(known.error(),
                  "the identity says another resolution than the options, or disagrees on whether there are turns: "
                  "leave resolution and multiturn_bits out, and it is asked");
  }
  format_ = *known;
  if (access_.active()) {
    if (protocol_version_ == version::aksim4) return finish(Error::unsupported, not_described);
    reset_pending_ = true;
  }
  on_identity(identity);
}

void Stream::good_position() {
  position_ = *decode_position(format_, reply_);
  ++frames_;
  reading_ = to_reading(format_, position_);
  if (detailed_status_) add_status(reading_, *detailed_status_);
  // On SPI the position is taken when NCS falls. The document does not say when it is on a UART: at the end of the
  // request at the latest.
  reading_.latched = wire_ == Wire::spi ? began_at_ : sent_at_;
  reading_.received = received_at_;
  if (asked_ == Asked::reset) {  // its byte of channel 2 is still one of before
    reset_pending_ = false;
    cycle_.restart();
  } else {
    follow_channel2();
  }
  if (!is_done()) on_frame();
  if (!is_done() && emits_frames_) emit_pending_ = true;
}

void Stream::bad_frame(Error error) {
  const std::string_view detail = describe(error);
  if (asked_ == Asked::identity) asked_ = Asked::position, identify_pending_ = true;
  cycle_.lose_step();
  reset_pending_ = uses_channel2_;
  if (--frame_attempts_left_ == 0 || is_noisy()) {
    access_.stop();
    return on_failure(error, detail);
  }
  if (access_.active()) try_access_again(error, detail);
}

std::string_view Stream::describe(Error error) const {
  if (is_noisy()) return noise_explanation().found;
  if (access_.active() && error == Error::timeout) return "the encoder stopped answering during a register access";
  switch (error) {
    case Error::wrong_length:
      if (asked_ == Asked::identity) {
        return "the encoder did not identify itself: it is starting, or resolution and multiturn_bits must be set";
      }
      return disturbed_ || reply_.size() > expected() ? "more came than one frame: other turns, or more than one sender"
                                                      : "the reply ended early";
    case Error::out_of_range:
      return asked_ != Asked::identity ? wrong_resolution : std::string_view{};
    case Error::line_stuck:
      return reply_[0] == 0 ? "MISO stayed low" : "MISO stayed high";
    default:
      return {};
  }
}

// ---- Channels 2 and 3

void Stream::follow_channel2() {
  const std::optional<Result<Cycle>> cycle = cycle_.feed(format_, position_);
  if (!cycle) return;
  const Error error = cycle->error();
  if (error == Error::none) {
    detailed_status_ = (*cycle)->status;
    add_status(reading_, *detailed_status_);
    access_.feed((*cycle)->channel3);
  } else {
    reset_pending_ = true;
    if (access_.active()) {
      return try_access_again(error, error == Error::cross_check_failed
                                         ? disagreement
                                         : "channel 2 is damaged: positions go on, but registers cannot be reached");
    }
  }
  on_cycle(error);
  if (!is_done()) follow_access();
}

void Stream::follow_access() {
  switch (access_.state()) {
    case RegisterAccess::State::done:
      if (access_.status() == AccessStatus::ok) {
        end_access(Error::none);
      } else if (is_damaged(access_.status()) && access_attempts_left_ > 0) {  // not executed
        access_.restart();
        --access_attempts_left_;
        reset_pending_ = true;
      } else {
        end_access(Error::request_rejected, text_of(access_.status()));
      }
      break;
    case RegisterAccess::State::ignored:
      try_access_again(Error::timeout, "the encoder ignores register accesses: positions go on");
      break;
    case RegisterAccess::State::nonsense:
      try_access_again(Error::unexpected_reply, "channel 3 says neither idle nor busy nor ready");
      break;
    case RegisterAccess::State::waiting:
      if (access_.busy() && received_at_ - access_.asked() > busy_limit) {
        end_access(Error::busy, "the register access was answered with busy for more than 2 s: positions go on");
      }
      break;
    default:
      break;
  }
}

void Stream::try_access_again(Error error, std::string_view detail) {
  cycle_.lose_step();
  // A write that may have been executed is not repeated blindly: whoever wants it reads back first.
  const bool blind = !access_.reads() && access_.was_asked();
  if (blind || access_attempts_left_ == 0) return end_access(error, detail);
  --access_attempts_left_;
  access_.restart();
  reset_pending_ = true;
}

void Stream::end_access(Error error, std::string_view detail) {
  access_.stop();
  if (error != Error::none) cycle_.lose_step();  // more of the answer may be coming
  on_access(error, detail);
}

// ---- ReadPosition

void ReadPosition::on_frame() {
  if (looking_closer_) return;
  looking_closer_ = format().has_ch2 && (position().error || position().warning || is_all_zero(position()));
  if (looking_closer_) {
    reset_channels();
  } else {
    finish();
  }
}

void ReadPosition::on_cycle(Error error) {
  if (error != Error::none && is_all_zero(position())) mark_not_ready();
  finish();
}

void ReadPosition::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put_fields(sink, format(), position());
  if (detailed_status()) put(sink, field_status, *detailed_status()), put(sink, field_alarms, *detailed_status());
}

// ---- ReadDetailedStatus

ReadDetailedStatus::ReadDetailedStatus(const Format& format, Wire wire)
    : Stream(format, wire, cycle_attempts), attempts_left_(cycle_attempts) {
  reset_channels();
}

void ReadDetailedStatus::on_cycle(Error error) {
  if (error != Error::none && --attempts_left_ > 0) return reset_channels();
  finish(error, error == Error::cross_check_failed ? disagreement : std::string_view{});
}

void ReadDetailedStatus::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put_fields(sink, format(), position());
  put(sink, field_status, *detailed_status());
  put(sink, field_alarms, *detailed_status());
}

// ---- Identify

Identify::Identify(const Format& format, Wire wire) : Stream(format, wire, 1) {
  trust_identity();
  identify();
}

void Identify::on_identity(const Identity& identity) {
  identity_ = identity;
  finish();
}

void Identify::report(FieldSink& sink) const {
  if (error() == Error::none) put_fields(sink, identity_);
}

}  // namespace absenc::encolink
