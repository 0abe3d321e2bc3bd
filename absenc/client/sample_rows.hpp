// SPDX-License-Identifier: Apache-2.0
// Samples as rows of named and typed values: what is printed, recorded and handed on.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absenc/client/encoder.hpp"
#include "absenc/client/reading_columns.hpp"
#include "absenc/client/row.hpp"

namespace absenc::client {

/// A row for each sample, and for readings that were due and not taken. Columns: `time_s`, `protocol`; `angle_deg`, of
/// linear encoders `position_mm` and `position_um`; `singleturn`, `multiturn` with their bits and whether they are
/// valid; flags; `confirmed`, `ok`; with motion `position`, `unwrapped_mm` (linear), `speed_rpm` or `speed_mm_s`,
/// the same as `speed_uncertainty_...`, `speed_delay_s`, `missed`; `event`, `message`, `sent`, `received`, which tell
/// what came in place of a reading.
class SampleRows {
 public:
  /// Whether rows also hold the motion that is computed from readings.
  enum class With : std::uint8_t { reading, motion };

  /// Times count from `start`, which is one of os::now.
  /// With `joint` there are columns of its angles: `joint_deg` or `joint_mm`, with motion `joint_speed_...` and its
  /// uncertainty, `electrical_deg`.
  SampleRows(const Unit& unit, const Options& options, Time start, With with, const Joint& joint = {});

  /// Returns the columns of each row, in their order.
  [[nodiscard]] std::span<const Column> columns() const { return columns_; }
  /// Valid until the next.
  [[nodiscard]] const Row& of(const Sample& sample);
  /// Of rows with motion: so many readings were due and were not taken. Valid until the next.
  [[nodiscard]] const Row& of_gap(Time at, std::uint64_t missed);

 private:
  std::size_t add(const Column& column);
  void add_motion();
  void add_angles();
  void begin(Time at, bool is_good, std::string_view event);
  void fill_motion(const Sample& sample);
  void fill_angles(const Sample& sample);

  const Unit* unit_;
  double unit_um_;  // 0: rotary
  Time start_;
  With with_;
  Joint joint_;
  ReadingColumns reading_;
  std::vector<Column> columns_;
  // Where they are.
  std::size_t protocol_, reading_at_, confirmed_, ok_;
  std::size_t motion_ = 0;  // the first of it; 0: there is none
  std::size_t missed_ = 0;
  std::size_t angles_ = 0;  // the first of them; 0: there are none
  std::size_t event_, message_, sent_, received_;
  Row row_;
};

}  // namespace absenc::client
