// SPDX-License-Identifier: Apache-2.0
// Speed from positions, with a delay that is known.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/core/time.hpp"

namespace absenc::host {

/// The mean speed between the newest position and the oldest one of a window: at constant acceleration exactly the
/// speed in the middle of that time, so the delay is half of it. One count of noise is one count divided by that time.
class Velocity {
 public:
  static constexpr std::size_t most_positions = 32;  // at high rates the window is as long as these

  /// At low rates the window is one step from reading to reading.
  explicit constexpr Velocity(Time window = std::chrono::milliseconds(50)) : window_(window) {}

  /// `position` as of `Unwrapper`, latched at `at`, which must lie after the one before; otherwise it is not taken.
  constexpr void add(std::int64_t position, Time at) {
    if (size_ != 0 && at <= from_newest(0).at) return;
    newest_ = (newest_ + 1) % most_positions;
    positions_[newest_] = {position, at};
    if (size_ < most_positions) ++size_;
    while (size_ > 2 && at - from_newest(size_ - 1).at > window_) --size_;
  }

  /// After a jump of the position, or a pause.
  constexpr void restart() { size_ = 0; }

  [[nodiscard]] constexpr bool valid() const { return size_ >= 2; }
  /// 0 while not valid.
  [[nodiscard]] constexpr double counts_per_second() const {
    if (!valid()) return 0;
    const auto counts = static_cast<std::int64_t>(static_cast<std::uint64_t>(from_newest(0).position) -
                                                  static_cast<std::uint64_t>(from_newest(size_ - 1).position));
    return static_cast<double>(counts) * 1e9 / static_cast<double>(span().count());
  }
  /// How long before the newest position the shaft had this speed. 0 while not valid.
  [[nodiscard]] constexpr Time delay() const { return valid() ? span() / 2 : Time{}; }

 private:
  struct Sample {
    std::int64_t position;
    Time at;
  };

  [[nodiscard]] constexpr const Sample& from_newest(std::size_t age) const {
    return positions_[(newest_ + most_positions - age) % most_positions];
  }
  [[nodiscard]] constexpr Time span() const { return from_newest(0).at - from_newest(size_ - 1).at; }

  Time window_;
  std::array<Sample, most_positions> positions_{};
  std::size_t newest_ = most_positions - 1;
  std::size_t size_ = 0;
};

}  // namespace absenc::host
