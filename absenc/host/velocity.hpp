// SPDX-License-Identifier: Apache-2.0
// Speed from positions, with its uncertainty and its delay.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/core/time.hpp"
#include "absenc/host/latch_time.hpp"

namespace absenc::host {

/// Mean speed between the newest position and an older one: at constant acceleration the speed in the middle of that
/// time. `uncertainty` covers the latch times and one count of each position, but no noise of the encoder.
class Velocity {
 public:
  static constexpr std::size_t most_positions = 48;  ///< Greatest number of positions that are stored.
  static constexpr int longest_windows = 20;         ///< Longest window, as a multiple of the shortest one.

  /// `window`: desired time over which the speed is measured.
  explicit constexpr Velocity(Time window = std::chrono::milliseconds(50)) : window_(window) {}

  /// Adds a position of `Unwrapper`. One that was not latched after the last one is ignored.
  constexpr void add(std::int64_t position, const LatchTime& at) {
    start_ = none;
    if (size_ != 0 && at.middle() <= newest().at.middle()) return;
    if (size_ == most_positions) thin_out();
    positions_[size_++] = {position, at};
    forget_old();
    choose_start();
  }
  /// Adds a position whose latch time is known exactly.
  constexpr void add(std::int64_t position, Time at) { add(position, {at, at}); }

  /// Forgets all stored positions, for use after a jump or a pause.
  constexpr void restart() {
    size_ = 0;
    start_ = none;
  }

  /// Returns whether a speed is known for the last added position.
  [[nodiscard]] constexpr bool valid() const { return start_ != none; }
  /// Returns the mean speed in counts per second; 0 while `valid()` is false.
  [[nodiscard]] constexpr double counts_per_second() const {
    if (!valid()) return 0;
    const double middle = (fastest() + slowest()) / 2;
    return moved() < 0 ? -middle : middle;
  }
  /// Returns the uncertainty of `counts_per_second` in counts/s; 0 while `valid()` is false.
  [[nodiscard]] constexpr double uncertainty() const { return valid() ? (fastest() - slowest()) / 2 : 0; }
  /// Returns the latch interval of the position that begins the window. Requires `valid()`.
  [[nodiscard]] constexpr const LatchTime& since() const { return positions_[start_].at; }
  /// Returns half the time between the two positions; 0 while `valid()` is false.
  [[nodiscard]] constexpr Time delay() const { return valid() ? span(start_) / 2 : Time{}; }

 private:
  struct Sample {
    std::int64_t position;
    LatchTime at;
  };
  static constexpr std::size_t none = ~std::size_t{0};
  // So many counts, and a window of so many times its uncertainty, are enough.
  static constexpr int enough = 20;
  static constexpr int least = 4;  // least ratio of the longest window to its uncertainty

  [[nodiscard]] constexpr const Sample& newest() const { return positions_[size_ - 1]; }
  [[nodiscard]] constexpr Time span(std::size_t start) const {
    return newest().at.middle() - positions_[start].at.middle();
  }
  [[nodiscard]] constexpr std::uint64_t moved_from(std::size_t start) const {
    const std::uint64_t way =
        static_cast<std::uint64_t>(newest().position) - static_cast<std::uint64_t>(positions_[start].position);
    return static_cast<std::int64_t>(way) < 0 ? 0 - way : way;
  }
  [[nodiscard]] constexpr std::int64_t moved() const { return newest().position - positions_[start_].position; }

  [[nodiscard]] static constexpr double per_second(double counts, Time time) {
    return counts * 1e9 / static_cast<double>(time.count());
  }
  // A distance may be one count longer or shorter than measured.
  [[nodiscard]] constexpr double fastest() const {
    return per_second(static_cast<double>(moved_from(start_)) + 1, newest().at.earliest - positions_[start_].at.latest);
  }
  [[nodiscard]] constexpr double slowest() const {
    const std::uint64_t way = moved_from(start_);
    if (way == 0) return -fastest();
    return per_second(static_cast<double>(way) - 1, newest().at.latest - positions_[start_].at.earliest);
  }

  // Drops old positions, but keeps one that is as old as the longest window or older.
  constexpr void forget_old() {
    std::size_t old = 0;
    while (old + 2 < size_ && span(old + 1) >= longest_windows * window_) ++old;
    if (old != 0) remove(0, old);
  }

  // Removes one position, so that old ones are stored at longer intervals than new ones.
  constexpr void thin_out() {
    std::size_t closest = 1;
    for (std::size_t i = 2; i + 1 < size_; ++i) {
      if (gap(i) * age(closest) < gap(closest) * age(i)) closest = i;
    }
    const bool drops_first = positions_[closest].at.width() > positions_[closest + 1].at.width();
    remove(drops_first || closest + 2 == size_ ? closest : closest + 1, 1);
  }
  // Uses units of about 1 us, so that a product of two fits into 64 bits.
  [[nodiscard]] constexpr std::int64_t gap(std::size_t i) const {
    return (positions_[i + 1].at.middle() - positions_[i].at.middle()).count() >> 10;
  }
  [[nodiscard]] constexpr std::int64_t age(std::size_t i) const { return span(i).count() >> 10; }

  constexpr void remove(std::size_t first, std::size_t count) {
    for (std::size_t i = first + count; i < size_; ++i) positions_[i - count] = positions_[i];
    size_ -= count;
  }

  // Selects the shortest window whose speed has a low enough uncertainty.
  constexpr void choose_start() {
    for (std::size_t i = size_ - 1; i-- > 0;) {
      const bool fills_window = span(i) >= window_ || (i > 0 && span(i - 1) > window_);
      if (!fills_window && i > 0) continue;
      const std::uint64_t way = moved_from(i);
      const bool is_resolved = way == 0 ? fills_window : way >= enough;
      // Uncertainty of the length of the window, to either side.
      const Time open = (newest().at.width() + positions_[i].at.width()) / 2;
      const bool is_longest = span(i) >= longest_windows * window_;
      if ((is_resolved && enough * open <= span(i)) || (is_longest && least * open <= span(i))) {
        start_ = i;
        return;
      }
    }
  }

  Time window_;
  std::array<Sample, most_positions> positions_{};  // stored positions with their latch times, the oldest first
  std::size_t size_ = 0;
  std::size_t start_ = none;  // index of the position that begins the selected window
};

}  // namespace absenc::host
