// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/live_encoder.hpp"

#include <fmt/format.h>

#include <cmath>

#include "absenc/host/speed_limit.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/output.hpp"
#include "tools/absenc/reading_text.hpp"

namespace absenc::tool {

namespace {

using namespace std::chrono_literals;

constexpr Time time_between_tries = 250ms;

// What transmits by itself has no time but that of its arrival.
host::Unwrapper make_unwrapper(const EncoderUri& uri) {
  const Unit& unit = *uri.unit;
  const bool unasked = unit.link == LinkKind::can || (unit.streams != nullptr && unit.streams(uri.options));
  return host::Unwrapper(speed_limit(uri), unasked ? host::Unwrapper::Times::arrived : host::Unwrapper::Times::latched);
}

std::string limit_text(const EncoderUri& uri, const Reading& reading) {
  const host::SpeedLimit limit = speed_limit(uri);
  if (reading.unit_um > 0) return fmt::format("{} mm/s", limit.mm_s);
  return fmt::format("{} rpm", limit.rpm);
}

double speed_of(const Reading& reading, double counts_per_second) {
  if (reading.unit_um > 0) return micrometres(counts_per_second, reading.unit_um) / 1000;
  return std::ldexp(60 * counts_per_second, -static_cast<int>(reading.singleturn_bits));
}

}  // namespace

LiveEncoder::LiveEncoder(const EncoderUri& uri, Time period)
    : encoder_(Encoder::make(uri)), period_(period), unwrapper_(make_unwrapper(uri)) {}

void LiveEncoder::connect() {
  encoder_->connect();
  offset_ = os::now() - encoder_->now();
  was_there_ = true;
}

void LiveEncoder::forget_position() {
  unwrapper_ = make_unwrapper(encoder_->uri());
  velocity_.restart();
}

Sample LiveEncoder::next() {
  if (!encoder_->connected()) return search();
  try {
    const Outcome outcome = encoder_->read(period_ == Time{} ? host::Take::every : host::Take::newest);
    if (outcome.error != Error::none) {
      return {.kind = Sample::Kind::failed, .at = os::now(), .trouble = encoder_->trouble(outcome)};
    }
    if (outcome.reading == nullptr) throw ToolFailure("the encoder's reply carries no position");
    return take(*outcome.reading);
  } catch (const os::Failure& failure) {
    encoder_->disconnect();
    velocity_.restart();
    ++losses_;
    lost_at_ = os::now();
    next_try_ = lost_at_ + time_between_tries;
    return {.kind = Sample::Kind::lost, .at = lost_at_, .message = failure.what()};
  }
}

Sample LiveEncoder::search() {
  os::sleep_until(next_try_);
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

double LiveEncoder::rate() const { return rate_.per_second(os::now()); }

std::vector<BadExchangeText> LiveEncoder::bad_exchanges() const {
  std::vector<BadExchangeText> exchanges = encoder_->bad_exchanges();
  for (BadExchangeText& exchange : exchanges) exchange.at += offset_;
  return exchanges;
}

Sample LiveEncoder::take(Reading reading) {
  reading.latched += offset_;
  reading.received += offset_;
  rate_.add(reading.received);
  ++readings_;
  Sample sample{.kind = Sample::Kind::reading, .at = reading.latched, .confirmed = encoder_->confirmed()};
  sample.doubtful = reading.ready && reading.singleturn_valid() && !sample.confirmed;
  sample.reading = reading = checked(reading, sample.confirmed);
  const host::Unwrapper::Joined joined = unwrapper_.add(reading);
  if (joined == host::Unwrapper::Joined::ignored) return sample;
  if (joined != host::Unwrapper::Joined::continued) velocity_.restart();
  if (joined == host::Unwrapper::Joined::restarted) note_restart(sample, reading);
  unwrapped_at_ = reading.latched;
  velocity_.add(unwrapper_.position(), reading.latched);
  sample.position_valid = true;
  sample.position = unwrapper_.position();
  sample.speed_valid = velocity_.valid();
  sample.speed = speed_of(reading, velocity_.counts_per_second());
  sample.speed_delay = velocity_.delay();
  return sample;
}

void LiveEncoder::note_restart(Sample& sample, const Reading& reading) {
  ++restarts_;
  sample.restarted = true;
  sample.message = fmt::format(
      "{} between two readings are too long to know how far it went meanwhile, at up to {}: the position starts again "
      "from the encoder's own{}",
      to_text(reading.latched - unwrapped_at_), limit_text(encoder_->uri(), reading),
      reading.unit_um > 0 ? "" : ". If the shaft is slower, say so with max_rpm=RPM");
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

std::string exchanges_text(const host::Counters& counters, std::uint64_t readings) {
  const std::string text = summary(counters);
  if (counters.good <= readings) return text;
  return fmt::format("{}; {} of the good ones confirmed a position, or were commands", text, counters.good - readings);
}

std::string_view speed_unit(const Reading& reading) { return reading.unit_um > 0 ? "mm/s" : "rpm"; }

void set_motion(Json& json, const Sample& sample, double unit_um) {
  const Json speed = sample.speed_valid ? Json(sample.speed) : Json();
  json.set("position", sample.position_valid ? Json(sample.position) : Json());
  if (unit_um > 0) {
    const double mm = micrometres(sample.position, unit_um) / 1000;
    json.set("unwrapped_mm", sample.position_valid ? Json(mm) : Json()).set("speed_mm_s", speed);
  } else {
    json.set("speed_rpm", speed);
  }
}

std::string LiveEncoder::rate_note() const {
  const EncoderUri& uri = encoder_->uri();
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

}  // namespace absenc::tool
