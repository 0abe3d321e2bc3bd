// SPDX-License-Identifier: Apache-2.0
// The columns of a reading, which rows of samples and rows of captures have in common.
#pragma once

#include <span>
#include <vector>

#include "absenc/client/row.hpp"

namespace absenc::client {

/// The columns of position, turns and flags in a row.
class ReadingColumns {
 public:
  /// Makes the columns for the unit with these options. `unit` must outlive this object.
  ReadingColumns(const Unit& unit, const Options& options);

  /// Returns the columns, in the order in which `fill` writes their values.
  [[nodiscard]] std::span<const Column> columns() const { return columns_; }
  /// Writes the reading into `values`, one value for each column.
  void fill(const Reading& reading, std::span<Value> values) const;

 private:
  const Unit* unit_;
  std::vector<Column> columns_;
};

}  // namespace absenc::client
