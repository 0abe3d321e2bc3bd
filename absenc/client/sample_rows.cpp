// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/sample_rows.hpp"

#include <chrono>

#include "absenc/core/angle.hpp"

namespace absenc::client {

namespace {

constexpr Column::Presentation detail{.is_detail = true};

double seconds(Time time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

SampleRows::SampleRows(const Unit& unit, const Options& options, Time start, With with, const Joint& joint)
    : unit_(&unit),
      unit_um_(unit.resolution(options).unit_um),
      start_(start),
      with_(with),
      joint_(joint),
      reading_(unit, options) {
  add({"time_s", "s", ColumnType::real, "seconds after `started`", {.format = "{:.6f}"}});
  protocol_ = add({"protocol", "", ColumnType::text, "", detail});
  reading_at_ = columns_.size();
  columns_.insert(columns_.end(), reading_.columns().begin(), reading_.columns().end());
  confirmed_ = add({"confirmed", "", ColumnType::boolean, "two readings in a row agreed", detail});
  ok_ = add({"ok", "", ColumnType::boolean, "whether it is a reading", detail});
  if (with == With::motion) add_motion();
  if (joint.is_set || joint.has_motor()) add_angles();
  event_ = add(
      {"event", "", ColumnType::text,
       "empty for a reading; restarted: it jumped, or came so long after the one before that the way between them is "
       "not known: position starts again; lost or back: the port; gap; otherwise the error that came in its place"});
  message_ = add({"message", "", ColumnType::text, "the event in words", detail});
  sent_ = add({"sent", "", ColumnType::text, "of a reading that failed", detail});
  received_ = add({"received", "", ColumnType::text, "of a reading that failed", detail});
  row_ = {columns_, std::vector<Value>(columns_.size())};
}

void SampleRows::add_motion() {
  const bool is_linear = unit_um_ > 0;
  motion_ =
      add({"position", "counts", ColumnType::int64, "counts, continued past the end of the encoder's own counter"});
  if (is_linear) add({"unwrapped_mm", "mm", ColumnType::real, "the same in millimetres"});
  const Column::Presentation rounded{.format = "{:.6g}"};
  const std::string_view mean = "mean over twice speed_delay_s";
  add(is_linear ? Column{"speed_mm_s", "mm/s", ColumnType::real, mean, rounded}
                : Column{"speed_rpm", "rpm", ColumnType::real, mean, rounded});
  const std::string_view most = "how far the true mean is from it at most: what times and counts leave open";
  const Column::Presentation three_digits{.format = "{:.3g}"};
  add(is_linear ? Column{"speed_uncertainty_mm_s", "mm/s", ColumnType::real, most, three_digits}
                : Column{"speed_uncertainty_rpm", "rpm", ColumnType::real, most, three_digits});
  const std::string_view before =
      is_linear ? "how long before time_s it was so fast" : "how long before time_s the shaft had that speed";
  add({"speed_delay_s", "s", ColumnType::real, before, {.format = "{:.6f}"}});
  missed_ = add({"missed", "", ColumnType::uint64, "of a gap: how many readings were due and were not taken"});
}

void SampleRows::add_angles() {
  const bool is_linear = unit_um_ > 0;
  angles_ = columns_.size();
  if (joint_.is_set) {
    add(is_linear ? Column{"joint_mm", "mm", ColumnType::real, "direction * (unwrapped_mm - offset_mm)"}
                  : Column{"joint_deg", "deg", ColumnType::real,
                           "direction * (degrees past the end of a turn - offset_deg) / gear; empty where the turns "
                           "are not known"});
  }
  if (joint_.is_set && with_ == With::motion) {
    const Column::Presentation rounded{.format = "{:.6g}"};
    const Column::Presentation three_digits{.format = "{:.3g}"};
    const std::string_view speed = "the speed at the joint";
    const std::string_view most = "how far the true mean is from it at most";
    add(is_linear ? Column{"joint_speed_mm_s", "mm/s", ColumnType::real, speed, rounded}
                  : Column{"joint_speed_rpm", "rpm", ColumnType::real, speed, rounded});
    add(is_linear ? Column{"joint_speed_uncertainty_mm_s", "mm/s", ColumnType::real, most, three_digits}
                  : Column{"joint_speed_uncertainty_rpm", "rpm", ColumnType::real, most, three_digits});
  }
  if (joint_.has_motor()) add({"electrical_deg", "deg", ColumnType::real, "of the motor, 0 to below 360"});
}

std::size_t SampleRows::add(const Column& column) {
  columns_.push_back(column);
  return columns_.size() - 1;
}

void SampleRows::begin(Time at, bool is_good, std::string_view event) {
  row_.values.assign(columns_.size(), {});
  row_.values[0] = seconds(at - start_);
  row_.values[ok_] = is_good;
  if (!event.empty()) row_.values[event_] = std::string(event);
}

const Row& SampleRows::of(const Sample& sample) {
  const bool is_reading = sample.kind == Sample::Kind::reading;
  begin(sample.at, is_reading, event_name(sample));
  std::vector<Value>& values = row_.values;
  if (is_reading) {
    values[protocol_] = std::string(unit_->id);
    reading_.fill(sample.reading, std::span(values).subspan(reading_at_, reading_.columns().size()));
    values[confirmed_] = sample.confirmed;
    if (motion_ != 0) fill_motion(sample);
    if (angles_ != 0) fill_angles(sample);
    return row_;
  }
  const bool is_failed = sample.kind == Sample::Kind::failed;
  values[message_] = is_failed ? sample.trouble.message : sample.message;
  if (!is_failed) return row_;
  values[sent_] = sample.trouble.sent;
  values[received_] = sample.trouble.received;
  return row_;
}

void SampleRows::fill_motion(const Sample& sample) {
  std::size_t at = motion_;
  const auto put = [&](bool is_valid, Value value) {
    row_.values[at++] = is_valid ? std::move(value) : Value(Invalid{});
  };
  put(sample.position_valid, sample.position);
  if (unit_um_ > 0) put(sample.position_valid, micrometres(sample.position, unit_um_) / 1000);
  put(sample.speed_valid, sample.speed);
  put(sample.speed_valid, sample.speed_uncertainty);
  put(sample.speed_valid, seconds(sample.speed_delay));
}

void SampleRows::fill_angles(const Sample& sample) {
  std::size_t at = angles_;
  const auto put = [&](const std::optional<double>& value) {
    row_.values[at++] = value ? Value(*value) : Value(Invalid{});
  };
  const JointAngles& angles = sample.angles;
  if (joint_.is_set) put(unit_um_ > 0 ? angles.joint_mm : angles.joint_deg);
  if (joint_.is_set && with_ == With::motion) {
    const std::optional<Estimate>& speed = unit_um_ > 0 ? angles.joint_speed_mm_s : angles.joint_speed_rpm;
    put(speed ? std::optional(speed->value) : std::nullopt);
    put(speed ? std::optional(speed->uncertainty) : std::nullopt);
  }
  if (joint_.has_motor()) put(angles.electrical_deg);
}

const Row& SampleRows::of_gap(Time at, std::uint64_t missed) {
  begin(at, false, "gap");
  row_.values[missed_] = missed;
  row_.values[message_] =
      std::string("readings were due and were not taken: the line or this computer was too slow, or stopped");
  return row_;
}

}  // namespace absenc::client
