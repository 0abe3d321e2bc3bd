// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/host.hpp"

#include "absenc/protocol/esl/fields.hpp"

namespace absenc::esl {

namespace {

constexpr unsigned attempts_in_procedures = 3;
constexpr Time between_looks = 10ms;              // two positions that far apart show whether the shaft turns
constexpr std::int64_t noise = 1 << 10;           // counts of 24 bits that a shaft at rest may tremble: 0.02 degrees
constexpr std::int64_t zero_tolerance = 1 << 14;  // 0.35 degrees, as T-format encoders have; the document gives none
constexpr unsigned safe_attempts = 6;

constexpr std::int64_t distance(std::uint32_t to, std::uint32_t from) {
  const std::int64_t difference = wrapped_difference(to, from, singleturn_bits);
  return difference < 0 ? -difference : difference;
}

}  // namespace

// ---- Read

Read::Read(const Profile& profile, DataId id) : Procedure(profile, 1), id_(id) {
  ask(id == DataId::encoder_id ? DataId::singleturn_short : id);
}

void Read::answered(const Reply& reply) {
  if (reply.id != id_) return ask(id_);
  reply_ = reply;
  reading_ = reading_of(reply);
  finish();
}

const Reading* Read::reading() const {
  return error() == Error::none && reading_.singleturn_bits != 0 ? &reading_ : nullptr;
}

void Read::report(FieldSink& sink) const {
  if (error() == Error::none) put_fields(sink, reply_);
}

// ---- ReadSafePosition

ReadSafePosition::ReadSafePosition(const Profile& profile) : Procedure(profile, 1), monitor_(profile) {
  ask(monitor_.next_id());
}

void ReadSafePosition::answered(const Reply& reply) {
  const SafetyVerdict verdict = monitor_.judge(request(), reply_bytes(), sent_at());
  ++exchanges_;
  failed_ = verdict.failed;
  reply_ = reply;
  reading_ = reading_of(reply);
  position_ = verdict.position;
  if (position_) return finish();
  if (failed_ == Check::sequence_unknown && exchanges_ < safe_attempts) return ask(monitor_.next_id());
  finish(error_of(failed_), text_of(failed_).sentence);
}

const SafePosition* ReadSafePosition::position() const {
  return error() == Error::none && position_ ? &*position_ : nullptr;
}

const Reading* ReadSafePosition::reading() const { return position() != nullptr ? &reading_ : nullptr; }

void ReadSafePosition::report(FieldSink& sink) const {
  if (position() == nullptr) return;
  put_fields(sink, reply_);
  put(sink, field_safe_singleturn, position()->singleturn());
}

// ---- Reset

Reset::Reset(const Profile& profile, DataId id) : Procedure(profile, attempts_in_procedures), id_(id) {
  ask(DataId::position);
}

void Reset::answered(const Reply& reply) {
  switch (phase_) {
    case Phase::first_look:
      before_ = reply.singleturn;
      phase_ = Phase::second_look;
      ask(DataId::position, received_at() + between_looks);
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
  if (!to_reading(reply).ready) {
    return finish(Error::invalid_argument, "the encoder is not ready yet; nothing was sent");
  }
  if (distance(reply.singleturn, before_) > noise) {
    return finish(Error::invalid_argument, "the shaft is turning: a reset needs it standing still; nothing was sent");
  }
  before_ = reply.singleturn;
  phase_ = Phase::requests;
  go_on();
}

// About 40 us from request to request; a slow line takes longer.
void Reset::go_on() {
  if (sent_requests_ < reset_requests) {
    const Time duration = line_settings.character() * static_cast<std::int64_t>(request_length(profile(), id_));
    const Time earliest = sent_requests_ == 0 ? Time{} : sent_at() + reset_interval - duration;
    ++sent_requests_;
    return ask(id_, earliest);
  }
  phase_ = Phase::verify;
  // B saves the zero in the EEPROM; D may do the same.
  ask(DataId::position, received_at() + (id_ == DataId::clear_alarms ? reset_interval : eeprom_write_time + 1ms));
}

void Reset::failed(Error error) {
  // When the last reply is lost, the reset may have been done all the same: reading tells.
  if (phase_ == Phase::requests && sent_requests_ == reset_requests) return go_on();
  if (phase_ == Phase::requests) {
    return finish(error,
                  "one of the eight requests was not answered well, so the encoder has most likely done nothing: read "
                  "the position before you try again");
  }
  if (phase_ == Phase::verify) {
    return finish(error, "all eight requests were sent, but whether the encoder obeyed could not be read");
  }
  finish(error);
}

void Reset::verify(const Reply& reply) {
  reply_ = reply;
  reading_ = reading_of(reply);
  if (id_ == DataId::zero && distance(reply.singleturn, 0) > zero_tolerance) {
    return finish(Error::cross_check_failed, "the position is still not zero");
  }
  if (id_ == DataId::reset_multiturn && reply.multiturn != 0) {
    return finish(Error::cross_check_failed, "the turns are still not zero");
  }
  // Rev 1.4 of the document added a single-turn clear to ID D and left it out elsewhere.
  if (id_ == DataId::reset_multiturn && distance(reply.singleturn, before_) > noise) {
    return finish(Error::cross_check_failed,
                  "the turns are zero, but the encoder has moved its single-turn zero too: find the origin again");
  }
  if (id_ == DataId::clear_alarms && remaining() != 0) {
    name_what_remains();
    return finish(Error::cross_check_failed);
  }
  finish();
}

void Reset::name_what_remains() {
  Sentence& sentence = explanation();
  sentence.clear();
  bool power_cycle = false;
  for (unsigned bit = 0; bit < 8; ++bit) {
    if ((remaining() >> bit & 1) == 0) continue;
    sentence.add(sentence.empty() ? "" : ", ").add(alarm_flags[bit].name);
    power_cycle = power_cycle || bit == 2 || bit == 3 || bit == 4 || bit == 5;  // Table 8
  }
  sentence.add((remaining() & (remaining() - 1)) == 0 ? " remains" : " remain");
  if ((remaining() & alarms::multiturn_error) != 0) sentence.add("; multiturn_error: reset-multiturn first");
  if (power_cycle) sentence.add("; switch the encoder off and on");
  if ((remaining() & alarms::voltage) != 0) sentence.add("; the supply voltage is wrong");
}

const Reading* Reset::reading() const { return error() == Error::none ? &reading_ : nullptr; }

void Reset::report(FieldSink& sink) const {
  if (error() == Error::none) put_fields(sink, reply_);
}

}  // namespace absenc::esl
