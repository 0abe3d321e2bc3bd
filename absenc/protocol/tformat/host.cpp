// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/tformat/host.hpp"

#include "absenc/protocol/tformat/explain.hpp"
#include "absenc/protocol/tformat/fields.hpp"

namespace absenc::tformat {

namespace {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

constexpr unsigned attempts_in_procedures = 3;
constexpr Time busy_pause = 1ms;      // between two looks at a busy encoder
constexpr Time between_looks = 10ms;  // two positions that far apart show whether the shaft turns

}  // namespace

void Procedure::ask(const Request& request, Time earliest) {
  request_ = request;
  request_bytes_ = encode_request(request);
  const bool writes = request.id == DataId::write_memory && !selects_page();
  attempts_left_ = writes || is_reset(request.id) ? 1 : read_attempts_;
  start(earliest);
}

void Procedure::start(Time earliest) {
  earliest_ = earliest;
  --attempts_left_;
  state_ = State::ready;
}

void Procedure::finish(Error error, std::string_view detail, std::string_view more) {
  error_ = error;
  const Explanation refusal = error == Error::request_rejected ? explain_refusal(reply_bytes_) : Explanation{};
  detail_.clear();
  detail_.add(refusal.found).add_part(detail).add_part(more);
  advice_ = refusal.advice;
  state_ = State::done;
  // A page change that was not answered well may be going on all the same: whoever comes next must find it ended.
  if (error != Error::none && selects_page() && sent_at_ != Time{}) {
    earliest_ = received_at_ + memory_time;
    state_ = State::ending;
  }
}

bool Procedure::selects_page() const {
  return request_.id == DataId::write_memory && request_.address == page_select_address;
}

ByteStep Procedure::next(Time now) {
  if (state_ == State::ending) {
    if (now < earliest_) return {.at = earliest_};
    state_ = State::done;
  }
  ByteStep step{.expect = expected(), .at = never, .answer = answer_limit, .gap = gap_limit};
  switch (state_) {
    case State::ready:
      begin_request();
      reply_bytes_.clear();
      step.kind = ByteStep::Kind::transfer;
      step.out = request_bytes_;
      step.expect = expected();
      step.at = earliest_;
      break;
    case State::sending:
      break;
    case State::receiving:
      step.expect -= reply_bytes_.size();
      break;
    case State::settling:
      step.expect = 0;
      break;
    case State::ending:
    case State::done:
      step.kind = ByteStep::Kind::done;
      break;
  }
  return step;
}

void Procedure::received(Bytes bytes) {
  for (const std::uint8_t byte : bytes) reply_bytes_.push_back(byte);
  if (state_ != State::receiving || reply_bytes_.size() < expected()) return;
  const Result<Reply> reply = decode_reply(format_, request_, reply_bytes_);
  // A refusal is complete and may be repeated at once. After anything else that is wrong more may be coming: wait for
  // silence, for sending while the encoder sends can destroy its driver (11).
  if (reply) {
    answered(*reply);
  } else if (reply.error() == Error::request_rejected) {
    conclude();
  } else {
    state_ = State::settling;
  }
}

void Procedure::conclude() {
  Error error = Error::wrong_length;  // disturbed: bytes that are not this reply's
  if (reply_bytes_.empty()) {
    error = disturbed_ ? Error::bad_framing : Error::timeout;
  } else if (!disturbed_ && !is_noisy()) {
    error = decode_reply(format_, request_, reply_bytes_).error();
  }
  if (attempts_left_ > 0 && !is_noisy()) {
    start(selects_page() ? received_at_ + memory_time : Time{});
  } else {
    failed(error);
  }
}

// A page change must not be disturbed by asking whether it is over.
void Procedure::ask_again() { ask(request_, received_at_ + (selects_page() ? memory_time : busy_pause)); }

Exchange<std::uint8_t> Procedure::exchange() const { return {request_bytes_, reply_bytes_, sent_at_, received_at_}; }

// ---- ReadPosition

ReadPosition::ReadPosition(const Format& format, DataId id, std::optional<std::uint8_t> known_alarms)
    : Procedure(format, 1), id_(id), known_alarms_(known_alarms) {
  const bool alarms_first = (id == DataId::singleturn || id == DataId::multiturn) && !known_alarms;
  ask({alarms_first ? DataId::everything : id});
}

void ReadPosition::answered(const Reply& reply) {
  if (reply.id == DataId::everything) {
    known_alarms_ = reply.alarms;
    if (id_ != DataId::everything && !part_read_) return ask({id_});
  } else if (id_ != DataId::encoder_id) {
    part_read_ = true;
    const int unknown = reply.status & ~status_for(known_alarms_.value_or(0));
    if (unknown != 0) return ask({DataId::everything});
  }
  reply_ = reply;
  reading_ = to_reading(format(), reply, known_alarms_);
  // The document does not say when the position is taken; the end of the request is the latest it can be.
  reading_.latched = sent_at();
  reading_.received = received_at();
  finish();
}

const Reading* ReadPosition::reading() const {
  return error() == Error::none && id_ != DataId::encoder_id ? &reading_ : nullptr;
}

void ReadPosition::report(FieldSink& sink) const {
  if (error() == Error::none) put_fields(sink, reply_);
}

// ---- Reset

Reset::Reset(const Format& format, DataId id) : Procedure(format, attempts_in_procedures), id_(id) {
  ask({DataId::everything});
}

void Reset::answered(const Reply& reply) {
  switch (phase_) {
    case Phase::first_look:
      reply_ = reply;
      phase_ = Phase::second_look;
      ask({DataId::everything}, received_at() + between_looks);
      break;
    case Phase::second_look:
      second_look(reply);
      break;
    case Phase::requests:
      go_on();
      break;
    case Phase::verify:
      verify(reply);
      break;
  }
}

void Reset::second_look(const Reply& reply) {
  const unsigned bits = format().singleturn_bits;
  const std::int64_t moved = wrapped_difference(reply.singleturn, reply_.singleturn, bits);
  const std::int64_t noise = bits > 14 ? std::int64_t{1} << (bits - 14) : 1;  // 0.02 degrees
  if (moved > noise || -moved > noise) {
    return finish(Error::invalid_argument, "the shaft is turning: a reset needs it standing still; nothing was sent");
  }
  // The position is too coarse then to show a movement.
  if ((reply.alarms & alarms::full_absolute_status) != 0) {
    return finish(Error::invalid_argument,
                  "full_absolute_status: the encoder was switched on while the shaft turned, and has not seen it stand "
                  "still since; nothing was sent");
  }
  if (id_ == DataId::clear_alarms && (reply.alarms & alarms::battery_error) != 0) {
    return finish(Error::invalid_argument,
                  "battery_error says that the turns are lost, and clearing it alone would hide that: replace the "
                  "battery, then reset the turns (reset-multiturn); nothing was sent");
  }
  phase_ = Phase::requests;
  go_on();
}

// Intervals are counted from the end of the reply: that is 40 us or more however the document means it.
void Reset::go_on() {
  if (sent_requests_ < reset_requests) {
    ++sent_requests_;
    return ask({id_}, received_at() + reset_interval);
  }
  phase_ = Phase::verify;
  // Only ID 8 writes the EEPROM; the tenth reply still shows the old errors (10).
  ask({DataId::everything}, received_at() + (id_ == DataId::zero ? memory_time : reset_interval));
}

void Reset::failed(Error error) {
  // When the tenth reply is lost, the reset may have been done all the same: reading tells.
  if (phase_ == Phase::requests && sent_requests_ == reset_requests) return go_on();
  if (phase_ == Phase::requests) {
    return finish(error,
                  "one of the ten requests was not answered well, so the encoder has most likely done nothing; "
                  "read the position before you try again");
  }
  if (phase_ == Phase::verify) {
    return finish(error, "all ten requests were sent, but whether the encoder obeyed could not be read");
  }
  finish(error);
}

void Reset::verify(const Reply& reply) {
  reply_ = reply;
  reading_ = to_reading(format(), reply);
  reading_.latched = sent_at();
  reading_.received = received_at();
  // 0.35 degrees (10), as the document's 127 counts of 17 bits.
  const std::int64_t off = wrapped_difference(reply.singleturn, 0, format().singleturn_bits);
  const std::int64_t tolerance = (std::int64_t{127} << format().singleturn_bits) >> 17;
  if (id_ == DataId::zero && (off > tolerance || -off > tolerance)) {
    return finish(Error::cross_check_failed, "the position is still not zero");
  }
  if (id_ == DataId::reset_multiturn && reply.multiturn != 0) {
    return finish(Error::cross_check_failed, "the turns are still not zero");
  }
  if (id_ != DataId::zero && (reply.alarms & alarms::over_heat) != 0) {
    return finish(Error::cross_check_failed, "over_heat remains: the encoder must cool down first");
  }
  if (id_ != DataId::zero && (reply.alarms & alarms::latched) != 0) {
    return finish(Error::cross_check_failed, "latched alarms remain: read them, mend their cause and try again");
  }
  finish();
}

const Reading* Reset::reading() const { return error() == Error::none ? &reading_ : nullptr; }

void Reset::report(FieldSink& sink) const {
  if (error() == Error::none) put_fields(sink, reply_);
}

}  // namespace absenc::tformat
