// SPDX-License-Identifier: Apache-2.0
// Converts samples to rows of named and typed values, for printing, recording and export.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absenc/client/encoder.hpp"
#include "absenc/client/reading_columns.hpp"
#include "absenc/client/row.hpp"

namespace absenc::client {

/// Rows of samples, and of gaps in which readings were due but not taken.
class SampleRows {
 public:
  /// Whether rows also have the columns of the motion, which is computed from several readings.
  enum class With : std::uint8_t { reading, motion };

  /// Makes the columns. `time_s` is the time since `start`, a time of os::now.
  SampleRows(const Unit& unit, const Options& options, Time start, With with, const Joint& joint = {});

  /// Returns the columns of each row, in their order.
  [[nodiscard]] std::span<const Column> columns() const { return columns_; }
  /// Returns the row of a sample. The row is valid until the next call.
  [[nodiscard]] const Row& of(const Sample& sample);
  /// Returns the row of a gap, valid until the next call. Only for rows with motion.
  [[nodiscard]] const Row& of_gap(Time at, std::uint64_t missed);

 private:
  std::size_t add(const Column& column);
  void add_motion();
  void add_angles();
  void begin(Time at, bool is_good, std::string_view event);
  void fill_motion(const Sample& sample);
  void fill_angles(const Sample& sample);

  const Unit* unit_;
  double unit_um_;  // length of one count of a linear encoder, in micrometres; 0: the encoder is rotary
  Time start_;
  With with_;
  Joint joint_;
  ReadingColumns reading_;
  std::vector<Column> columns_;
  // Index of each column in a row; 0 for a column that the rows do not have.
  std::size_t protocol_, reading_at_, confirmed_, ok_;
  std::size_t motion_ = 0;  // index of the first column of the motion in a row; 0: rows have no such columns
  std::size_t missed_ = 0;
  std::size_t angles_ = 0;  // index of the first column of joint angles in a row; 0: rows have no such columns
  std::size_t event_, message_, sent_, received_;
  Row row_;
};

}  // namespace absenc::client
