// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/bus.hpp"

#include <algorithm>

#include "absenc/protocol/esl/fields.hpp"

namespace absenc::esl {

namespace {

constexpr unsigned scan_attempts = 3;

std::array<SafetyMonitor, most_encoders> monitors(const Profile& profile) {
  const SafetyMonitor one(profile);
  return {one, one, one, one, one, one, one, one};
}

}  // namespace

// ---- Poll

Poll::Poll(const Profile& profile, std::span<const std::uint8_t> addresses, DataId id, std::uint64_t cycles, Time pause)
    : Procedure(profile, 1), id_(id), last_cycle_(cycles), pause_(pause), monitors_(monitors(profile)) {
  const bool reads_position = is_safety_position(id) || id == DataId::position_short || id == DataId::singleturn_short;
  if (addresses.empty() || addresses.size() > most_encoders || !reads_position) {
    finish(Error::invalid_argument, "poll 1 to 8 addresses for ID 1, 2, 4 or 5");
    return;
  }
  for (const std::uint8_t address : addresses) encoders_[count_++].address = address & 7;
  ask_current({});
}

void Poll::ask_current(Time earliest) {
  const DataId id = is_safety_position(id_) ? monitors_[current_].next_id(id_) : id_;
  ask(Request{id, encoders_[current_].address}, earliest);
}

void Poll::answered(const Reply& reply) {
  Polled& encoder = encoders_[current_];
  encoder.error = Error::none;
  encoder.reading = reading_of(reply);
  ++encoder.good;
  encoder.longest = std::max(encoder.longest, received_at() - sent_at());
  encoder.position.reset();
  if (is_safety_position(id_)) {
    const SafetyVerdict verdict = monitors_[current_].judge(request(), reply_bytes(), sent_at());
    encoder.position = verdict.position;
    encoder.failed = verdict.failed;
    if (verdict.position) ++encoder.safe;
  }
  go_on();
}

void Poll::failed(Error error) {
  Polled& encoder = encoders_[current_];
  encoder.error = error;
  encoder.failed = check();
  encoder.position.reset();
  ++encoder.errors[static_cast<std::size_t>(error)];
  monitors_[current_].missed(request());
  go_on();
}

void Poll::go_on() {
  if (++current_ == count_) {
    current_ = 0;
    ++cycles_;
    emit();
    if (cycles_ == last_cycle_) return finish();
  }
  ask_current(received_at() + pause_);
}

void Poll::report(FieldSink& sink) const {
  std::int64_t answering = 0;
  std::int64_t disturbed = 0;
  for (const Polled& encoder : encoders()) {
    const std::int64_t bit = std::int64_t{1} << encoder.address;
    if (encoder.error == Error::none) answering |= bit;
    if (encoder.error != Error::none && encoder.error != Error::timeout) disturbed |= bit;
  }
  put(sink, field_answering, answering);
  put(sink, field_disturbed, disturbed);
}

// ---- Scan

Scan::Scan(const Profile& profile) : Procedure(profile, scan_attempts) {
  ask(Request{DataId::singleturn_short, address_});
}

void Scan::answered(const Reply& reply) {
  answering_ = static_cast<std::uint8_t>(answering_ | 1u << address_);
  last_[address_] = reply;
  go_on();
}

void Scan::failed(Error error) {
  if (is_noisy()) return finish(error);
  if (error != Error::timeout) disturbed_ = static_cast<std::uint8_t>(disturbed_ | 1u << address_);
  go_on();
}

void Scan::go_on() {
  if (++address_ < most_encoders)
    return ask(Request{DataId::singleturn_short, address_}, received_at() + request_pause);
  finish(answering_ == 0 && disturbed_ == 0 ? Error::timeout : Error::none);
}

void Scan::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  for (std::uint8_t address = 0; address < most_encoders; ++address) {
    const bool answers = (answering_ >> address & 1) != 0;
    if (!answers && (disturbed_ >> address & 1) == 0) continue;
    put(sink, field_encoder_address, address);
    put(sink, field_clash, answers ? 0 : 1);
    const Reply& reply = last_[address];
    if (!answers) continue;
    put(sink, field_ch1_status, reply.one.status);
    put(sink, field_singleturn, reply.singleturn);
    sink.put_reading(to_reading(reply));
  }
}

}  // namespace absenc::esl
