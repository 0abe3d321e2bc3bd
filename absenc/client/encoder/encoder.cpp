// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/encoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "absenc/client/encoder/connection.hpp"
#include "absenc/client/encoder/end_at.hpp"
#include "absenc/client/encoder/pace.hpp"
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
constexpr Time between_looks = 20ms;  // whether it was cancelled

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

// Of our clock to the port's, which may be a simulated one. This thread may be set aside between looking at the two:
// looked at some times, the quickest look is right.
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

Encoder::Encoder(const EncoderAddress& address, Time period)
    : cancelled_(std::make_unique<std::atomic<bool>>(false)),
      connection_(Connection::make(address)),
      period_(period),
      unwrapper_(make_unwrapper(address)) {
  end_when({});
}
Encoder::Encoder(Encoder&&) noexcept = default;
Encoder& Encoder::operator=(Encoder&&) noexcept = default;
Encoder::~Encoder() = default;

Encoder open(std::string_view text, std::span<const std::string> settings) {
  Encoder encoder(parse_address(text, settings), Time{});
  encoder.connect();
  return encoder;
}

void Encoder::cancel() { cancelled_->store(true); }
void Encoder::resume() { cancelled_->store(false); }

const Unit& Encoder::unit() const { return connection_->unit(); }
const Options& Encoder::options() const { return connection_->uri().options; }
const Joint& Encoder::joint() const { return connection_->uri().joint; }
const std::vector<std::string>& Encoder::notes() const { return connection_->notes(); }
const host::Counters& Encoder::counters() const { return connection_->counters(); }
const host::Latencies& Encoder::latencies() const { return connection_->latencies(); }

Reading Encoder::read(Time deadline) {
  if (deadline == never) return read_now();
  const EndAt end(*this, deadline);
  try {
    return read_now();
  } catch (const Cancelled&) {
    if (*cancelled_ || os::now() < deadline) throw;
    throw DeadlinePassed{};
  }
}

Reading Encoder::read_now() {
  if (!connection_->connected()) connect();
  Sample sample = next();
  if (sample.kind == Sample::Kind::failed) throw EncoderFailure(std::move(sample.trouble));
  if (sample.kind == Sample::Kind::lost) throw os::Failure(os::Failure::Kind::lost, sample.message);
  return sample.reading;
}

Reading Encoder::read_alarms() {
  if (!connection_->connected()) connect();
  return client::read_alarms(*connection_);
}

Answer Encoder::run(std::string_view name, std::span<const std::int64_t> arguments) {
  const Command& command = require_command(unit(), name);
  if (!connection_->connected()) {
    if (!command.changes_encoder) connect();
    if (command.changes_encoder) before_change([this] { connect(); });
  }
  AnswerSink sink;
  run_into(*connection_, command, complete_arguments(command, arguments), sink);
  return std::move(sink.answer);
}

std::function<bool()> Encoder::end_when(std::function<bool()> over) {
  over_.swap(over);
  connection_->end_when([cancelled = cancelled_.get(), now = over_] { return cancelled->load() || (now && now()); });
  return over;
}

void Encoder::wait_until(Time time) const {
  while (os::now() < time) {
    if (*cancelled_ || (over_ && over_())) throw Cancelled{};
    os::sleep_until(std::min(time, os::now() + between_looks));
  }
}

Samples Encoder::samples(const SampleChoices& choices) { return {*this, choices}; }

Samples::Samples(Encoder& encoder, const SampleChoices& choices)
    : encoder_(&encoder),
      count_(choices.count),
      deadline_(choices.deadline),
      pace_(std::make_unique<Pace>(choices.rate_hz)) {
  encoder.period_ = pace_->period();
}
Samples::Samples(Samples&&) noexcept = default;
Samples& Samples::operator=(Samples&&) noexcept = default;
Samples::~Samples() = default;

Samples::Iterator Samples::begin() {
  advance();
  return Iterator(*this);
}

void Samples::advance() {
  ended_ = count_ != 0 && taken_ == count_;
  if (ended_) return;
  const auto take = [this] {
    if (taken_ != 0) encoder_->wait_until(pace_->next());
    sample_ = encoder_->next();
    ++taken_;
  };
  try {
    if (deadline_ == never) return take();
    if (os::now() >= deadline_) throw DeadlinePassed{};
    const EndAt end(*encoder_, deadline_);
    take();
  } catch (const Cancelled&) {
    ended_ = true;
  }
}

void Encoder::connect() {
  connection_->connect();
  offset_ = ahead_of(*connection_);
  was_there_ = true;
}

const Change& Encoder::change() const { return connection_->change(); }

void Encoder::forget_position() {
  unwrapper_ = make_unwrapper(connection_->uri());
  velocity_.restart();
}

Sample Encoder::next() {
  if (!connection_->connected()) return search();
  try {
    const host::Take which = period_ == Time{} ? host::Take::every : host::Take::newest;
    const Outcome outcome = connection_->read(which);
    if (outcome.error != Error::none) {
      return {.kind = Sample::Kind::failed, .at = os::now(), .trouble = connection_->trouble(outcome)};
    }
    if (outcome.reading == nullptr) {
      const Command* command = connection_->uri().reads;
      throw Failure(command == nullptr ? std::string("the encoder's reply carries no position")
                                       : fmt::format("{} yields no position", command->name));
    }
    return take(*outcome.reading);
  } catch (const os::Failure& failure) {
    connection_->disconnect();
    velocity_.restart();
    ++losses_;
    lost_at_ = os::now();
    next_try_ = lost_at_ + time_between_tries;
    return {.kind = Sample::Kind::lost, .at = lost_at_, .message = failure.what()};
  }
}

Sample Encoder::search() {
  wait_until(next_try_);
  const Time now = os::now();
  next_try_ = now + time_between_tries;
  const bool again = was_there_;
  try {
    connect();
  } catch (const os::Failure& failure) {
    return {.kind = Sample::Kind::absent, .at = now, .message = failure.what()};
  }
  const std::string sentence =
      again ? fmt::format("the port is back after {}", to_text(os::now() - lost_at_)) : "the port is open";
  return {.kind = Sample::Kind::back, .at = os::now(), .message = sentence};
}

double Encoder::rate() const { return rate_.per_second(os::now()); }

std::vector<BadExchangeText> Encoder::bad_exchanges() const {
  std::vector<BadExchangeText> exchanges = connection_->bad_exchanges();
  for (BadExchangeText& exchange : exchanges) exchange.at += offset_;
  return exchanges;
}

Sample Encoder::take(Reading reading) {
  reading.latched += offset_;
  reading.received += offset_;
  rate_.add(reading.received);
  ++readings_;
  Sample sample{.kind = Sample::Kind::reading, .at = reading.latched, .confirmed = connection_->confirmed()};
  sample.doubtful = reading.ready && reading.singleturn_valid() && !sample.confirmed;
  sample.reading = reading = checked(reading, sample.confirmed);
  host::LatchTime latched = connection_->latch_time();
  latched.earliest += offset_;
  latched.latest += offset_;
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

// For a sample whose position is valid.
JointAngles Encoder::angles_of(const Sample& sample) const {
  const Joint& one = joint();
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

void Encoder::note_restart(Sample& sample, bool jumped, Time pause) {
  ++restarts_;
  sample.restarted = true;
  const std::string limit = limit_text(connection_->uri(), sample.reading);
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

PositionState Sample::position_state() const {
  if (kind != Kind::reading) return PositionState::none;
  if (!reading.ready) return PositionState::starting;
  if (doubtful) return PositionState::unconfirmed;
  switch (reading.singleturn_validity()) {
    case Validity::valid:
      return PositionState::good;
    case Validity::invalid:
      return PositionState::invalid;
    case Validity::unknown:
      return PositionState::unknown;
    case Validity::absent:
      break;
  }
  return PositionState::none;
}

std::optional<Estimate> Sample::measured_speed() const {
  if (!speed_valid) return {};
  return Estimate{speed, speed_uncertainty};
}

std::optional<Estimate> Sample::speed_rpm() const { return reading.unit_um > 0 ? std::nullopt : measured_speed(); }

std::optional<Estimate> Sample::speed_mm_s() const { return reading.unit_um > 0 ? measured_speed() : std::nullopt; }

std::string_view text_of(PositionState state) {
  switch (state) {
    case PositionState::good:
      return "the position is good: a second one agreed, and nothing that was reported is against it";
    case PositionState::unconfirmed:
      return "no second position agreed with this one: do not use it, read again";
    case PositionState::starting:
      return "the encoder is starting: read again";
    case PositionState::invalid:
      return "an alarm or a state that the encoder reports says that the position does not hold: look at its alarms";
    case PositionState::unknown:
      return "whether the position holds was not reported: read the alarms";
    case PositionState::none:
      break;
  }
  return "there is no position";
}

std::string_view event_name(const Sample& sample) {
  switch (sample.kind) {
    case Sample::Kind::lost:
      return "lost";
    case Sample::Kind::back:
      return "back";
    case Sample::Kind::failed:
      return text_of(sample.trouble.error).name;
    case Sample::Kind::reading:
      return sample.restarted ? "restarted" : "";
    default:
      return "";
  }
}

std::string_view speed_unit(const Reading& reading) { return reading.unit_um > 0 ? "mm/s" : "rpm"; }

std::string Encoder::rate_note() const {
  const EncoderAddress& uri = connection_->uri();
  const Resolution resolution = uri.unit->resolution(uri.options);
  const host::SpeedLimit limit = speed_limit(uri);
  const Time longest = host::longest_gap(resolution, limit);
  if (period_ == Time{} || period_ < longest || resolution.unit_um > 0) return {};
  const auto seconds = [](Time time) { return std::chrono::duration<double>(time).count(); };
  return fmt::format(
      "at this rate the turns are followed up to {:.0f} rpm, but the shaft may reach {} rpm: {:.0f} readings a second "
      "would be enough; if it is slower, say so with max_rpm=RPM",
      std::floor(limit.rpm * seconds(longest) / seconds(period_)), limit.rpm, std::floor(1 / seconds(longest)) + 1);
}

}  // namespace absenc::client
