// SPDX-License-Identifier: Apache-2.0
// The columns of a reading, which rows of samples and of captures have in common.
#pragma once

#include <span>
#include <vector>

#include "absenc/client/row.hpp"

namespace absenc::client {

/// Position, turns and flags. Two channels have columns of their own for their flags, and `alarms` for those that
/// either has.
class ReadingColumns {
 public:
  /// `unit` must outlive it.
  ReadingColumns(const Unit& unit, const Options& options);

  /// Returns the columns of each row, in their order.
  [[nodiscard]] std::span<const Column> columns() const { return columns_; }
  /// One value for each column: nothing for what the reading does not carry. In place of a position in degrees or
  /// millimetres that does not hold there is `Invalid`, of flags that nobody has reported `Unknown`.
  void fill(const Reading& reading, std::span<Value> values) const;

 private:
  const Unit* unit_;
  std::vector<Column> columns_;
};

}  // namespace absenc::client
