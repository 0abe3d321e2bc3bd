// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/encoder/parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/client/reading.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/speed_limit.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

namespace {

using namespace std::chrono_literals;

constexpr Time time_between_tries = 250ms;
constexpr Time between_looks = 20ms;  // time between two checks, during a wait, whether the wait was cancelled

host::Unwrapper make_unwrapper(const EncoderAddress& uri) {
  const bool unsolicited = host::sends_unsolicited(*uri.unit, uri.options);
  return host::Unwrapper(speed_limit(uri), unsolicited ? host::Times::arrived : host::Times::latched);
}

std::string limit_text(const EncoderAddress& uri, const Reading& reading) {
  const host::SpeedLimit limit = speed_limit(uri);
  if (reading.unit_um > 0) return fmt::format("{} mm/s", limit.mm_s);
  return fmt::format("{} rpm", limit.rpm);
}

double speed_of(const Reading& reading, double counts_per_second) {
  if (reading.unit_um > 0) return micrometres(counts_per_second, reading.unit_um) / 1000;
  return std::ldexp(60 * counts_per_second, -static_cast<int>(reading.singleturn_bits));
}

// Returns the offset from the connection's clock to os::now. The quickest of five measurements is the most exact.
Time ahead_of(Connection& connection) {
  Time quickest = never;
  Time ahead{};
  for (int look = 0; look < 5; ++look) {
    const Time before = os::now();
    const Time there = connection.now();
    const Time took = os::now() - before;
    if (took >= quickest) continue;
    quickest = took;
    ahead = before + took / 2 - there;
  }
  return ahead;
}

}  // namespace

Encoder::Parts::Parts(const EncoderAddress& address, Time reading_period, OpenLink open)
    : connection(Connection::make(address, std::move(open))),
      period(reading_period),
      unwrapper_(make_unwrapper(address)) {
  connection->end_when([this] { return must_end(); });
}

Encoder make_encoder(const EncoderAddress& address, Time period, OpenLink open) {
  return Encoder::Parts::make(std::make_unique<Encoder::Parts>(address, period, std::move(open)));
}

void Encoder::Parts::connect() {
  connection->connect();
  offset = ahead_of(*connection);
  lost_at_.reset();
}

void Encoder::Parts::disconnect() {
  connection->disconnect();
  velocity_.restart();
  lost_at_.reset();
}

bool Encoder::Parts::must_end() const { return cancelled || (over && over()); }

void Encoder::Parts::wait_until(Time time) const {
  while (os::now() < time) {
    if (must_end()) throw Cancelled{};
    os::sleep_until(std::min(time, os::now() + between_looks));
  }
}

void Encoder::Parts::forget_position() {
  unwrapper_ = make_unwrapper(connection->uri());
  velocity_.restart();
}

Sample Encoder::Parts::next() {
  if (!connection->connected()) return search();
  try {
    const host::Take which = period == Time{} ? host::Take::every : host::Take::newest;
    const Outcome outcome = connection->read(which);
    if (outcome.error != Error::none) {
      return {.kind = Sample::Kind::failed, .at = os::now(), .trouble = connection->trouble(outcome)};
    }
    if (outcome.reading == nullptr) {
      const Command* command = connection->uri().reads;
      throw Failure(command == nullptr ? std::string("the encoder's reply carries no position")
                                       : fmt::format("{} yields no position", command->name));
    }
    return sample_of(*outcome.reading);
  } catch (const os::Failure& failure) {
    disconnect();
    ++losses;
    const Time now = os::now();
    lost_at_ = now;
    next_try_ = now + time_between_tries;
    return {.kind = Sample::Kind::lost, .at = now, .message = failure.what()};
  }
}

Sample Encoder::Parts::search() {
  wait_until(next_try_);
  const Time now = os::now();
  next_try_ = now + time_between_tries;
  const std::optional<Time> lost_at = lost_at_;
  try {
    connect();
  } catch (const os::Failure& failure) {
    return {.kind = Sample::Kind::absent, .at = now, .message = failure.what()};
  }
  const std::string sentence =
      lost_at ? fmt::format("the port is back after {}", to_text(os::now() - *lost_at)) : "the port is open";
  return {.kind = Sample::Kind::back, .at = os::now(), .message = sentence};
}

Sample Encoder::Parts::sample_of(Reading reading) {
  reading.latched += offset;
  reading.received += offset;
  rate.add(reading.received);
  ++readings;
  Sample sample{.kind = Sample::Kind::reading, .at = reading.latched, .confirmed = connection->confirmed()};
  sample.doubtful = reading.ready && reading.singleturn_valid() && !sample.confirmed;
  sample.reading = reading = checked(reading, sample.confirmed);
  host::LatchTime latched = connection->latch_time();
  latched.earliest += offset;
  latched.latest += offset;
  const bool jumped = unwrapper_.jumps(reading);
  if (jumped) forget_position();
  const host::Unwrapper::Joined joined = unwrapper_.add(reading, latched);
  if (joined == host::Unwrapper::Joined::ignored) return sample;
  if (joined != host::Unwrapper::Joined::continued) velocity_.restart();
  if (jumped || joined == host::Unwrapper::Joined::restarted) {
    note_restart(sample, jumped, latched.latest - unwrapped_at_);
  }
  unwrapped_at_ = latched.earliest;
  velocity_.add(unwrapper_.position(), latched);
  sample.position_valid = true;
  sample.position = unwrapper_.position();
  sample.speed_valid = velocity_.valid();
  sample.speed = speed_of(reading, velocity_.counts_per_second());
  sample.speed_uncertainty = std::abs(speed_of(reading, velocity_.uncertainty()));
  if (sample.speed_valid) sample.speed_delay = velocity_.delay() - (latched.middle() - reading.latched);
  sample.angles = angles_of(sample);
  return sample;
}

// Returns the angles of joint and motor for a sample whose position is valid.
JointAngles Encoder::Parts::angles_of(const Sample& sample) const {
  const Joint& one = connection->uri().joint;
  const Reading& reading = sample.reading;
  const bool is_linear = reading.unit_um > 0;
  JointAngles angles;
  if (one.has_motor()) {
    angles.electrical_deg = electrical_degrees(one, is_linear ? micrometres(reading.singleturn, reading.unit_um) / 1000
                                                              : degrees(reading.singleturn, reading.singleturn_bits));
  }
  if (!one.is_set) return angles;
  std::optional<Estimate>& speed = is_linear ? angles.joint_speed_mm_s : angles.joint_speed_rpm;
  if (sample.speed_valid) speed = joint_speed(one, *sample.measured_speed());
  if (is_linear) {
    angles.joint_mm = joint_millimetres(one, micrometres(sample.position, reading.unit_um) / 1000);
  } else if (unwrapper_.counts_turns() || one.gear == 1) {
    const double turns = std::ldexp(static_cast<double>(sample.position), -static_cast<int>(reading.singleturn_bits));
    angles.joint_deg = joint_degrees(one, 360 * turns);
  }
  return angles;
}

void Encoder::Parts::note_restart(Sample& sample, bool jumped, Time pause) {
  ++restarts;
  sample.restarted = true;
  const std::string limit = limit_text(connection->uri(), sample.reading);
  const bool rotates = sample.reading.unit_um == 0;
  if (jumped) {
    sample.message = fmt::format(
        "the position jumped farther than at {} and stayed there, as if somebody moved its zero: it starts again from "
        "the encoder's own{}",
        limit,
        rotates ? ". If the shaft is faster, say so with max_rpm=RPM" : ". If it is faster, say so with max_mm_s=MM/S");
    return;
  }
  sample.message = fmt::format(
      "{} between two readings are too long to know how far it went meanwhile, at up to {}: the position starts again "
      "from the encoder's own{}",
      to_text(pause), limit,
      rotates ? ". If the shaft is slower, say so with max_rpm=RPM" : ". If it is slower, say so with max_mm_s=MM/S");
}

}  // namespace absenc::client
