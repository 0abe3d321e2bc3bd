// SPDX-License-Identifier: Apache-2.0
// The columns of a reading, which rows of samples and rows of captures have in common.
#pragma once

#include <span>
#include <vector>

#include "absenc/client/row.hpp"

namespace absenc::client {

/// The columns of position, turns and flags in a row. A unit with two channels has columns of flags for each channel,
/// and the column `alarms` with the alarms of both channels.
class ReadingColumns {
 public:
  /// Makes the columns for the unit with these options. `unit` must outlive this object.
  ReadingColumns(const Unit& unit, const Options& options);

  /// Returns the columns, in the order in which `fill` writes their values.
  [[nodiscard]] std::span<const Column> columns() const { return columns_; }
  /// Writes the reading into `values`, one value for each column. A value that the reading does not have becomes empty.
  /// A position in degrees, millimetres or micrometres becomes `Invalid` unless it is known to be valid; flags and
  /// validity become values as `value_of` returns them.
  void fill(const Reading& reading, std::span<Value> values) const;

 private:
  const Unit* unit_;
  std::vector<Column> columns_;
};

}  // namespace absenc::client
