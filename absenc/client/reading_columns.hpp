// SPDX-License-Identifier: Apache-2.0
// The columns of a reading, which rows of samples and rows of captures share.
#pragma once

#include <span>
#include <vector>

#include "absenc/client/row.hpp"

namespace absenc::client {

/// Columns of position, turns and flags. A unit with two channels has flag columns for each channel, and `alarms` with
/// the alarms of either.
class ReadingColumns {
 public:
  /// Makes the columns of a unit. `unit` must outlive this object.
  ReadingColumns(const Unit& unit, const Options& options);

  /// Returns the columns of each row, in their order.
  [[nodiscard]] std::span<const Column> columns() const { return columns_; }
  /// Fills one value into each column. A value that the reading does not carry stays empty. An invalid position in
  /// degrees or millimetres becomes `Invalid`, flags that no reply has reported become `Unknown`.
  void fill(const Reading& reading, std::span<Value> values) const;

 private:
  const Unit* unit_;
  std::vector<Column> columns_;
};

}  // namespace absenc::client
