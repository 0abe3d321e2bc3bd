// SPDX-License-Identifier: Apache-2.0
// Plots positions over time in the columns of a terminal, for a capture of any length.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/core/angle.hpp"

namespace absenc::client {

class PositionTrace {
 public:
  static constexpr std::size_t columns = 64;

  /// Adds a position; one that is invalid, not ready or lacks its turns leaves a gap in the plot.
  void add(std::uint64_t tick, const Reading& reading) {
    if (!reading.singleturn_valid() || !reading.ready) return;
    if (count_ == 0) {
      first_ = tick;
      bits_ = reading.singleturn_bits;
      unit_um_ = reading.unit_um;
      signed_ = reading.multiturn_signed;
      turns_ = reading.multiturn_valid && reading.multiturn_bits + bits_ <= 64;
    }
    if (turns_ && !reading.multiturn_valid) return;
    ++count_;
    last_ = std::max(tick, first_);
    const std::uint64_t since = tick - std::min(tick, first_);
    while (since >> shift_ >= columns) halve();
    Extent& column = columns_[static_cast<std::size_t>(since >> shift_)];
    const auto turns = static_cast<std::uint64_t>(turns_ ? reading.turns() : 0);
    const std::uint64_t counts = (reading.singleturn | turns << bits_) + offset();
    column.least = std::min(column.least, counts);
    column.most = std::max(column.most, counts);
  }

  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// Returns a small plot with its scale; "" if no position was valid.
  [[nodiscard]] std::string plot() const;
  /// Return the tick (the time in the capture) of the first and of the last valid position that was added.
  [[nodiscard]] std::uint64_t first() const { return first_; }
  [[nodiscard]] std::uint64_t last() const { return last_; }

 private:
  struct Extent {
    std::uint64_t least = UINT64_MAX;
    std::uint64_t most = 0;
    [[nodiscard]] bool empty() const { return least > most; }
  };

  void halve();
  // Returns the offset that makes positions with negative turns sort before those with positive turns; 0 if none is
  // needed.
  [[nodiscard]] std::uint64_t offset() const { return turns_ && signed_ ? std::uint64_t{1} << 63 : 0; }
  [[nodiscard]] double value(std::uint64_t counts) const;
  [[nodiscard]] std::string_view unit() const;

  std::array<Extent, columns> columns_{};
  unsigned shift_ = 0;  // each column of the plot covers 2^shift_ ticks
  std::uint64_t first_ = 0;
  std::uint64_t last_ = 0;
  std::uint64_t count_ = 0;
  unsigned bits_ = 1;
  bool signed_ = false;
  // whether the first valid position had turns, and turns and position together had at most 64 bits
  bool turns_ = false;
  double unit_um_ = 0;
};

}  // namespace absenc::client
