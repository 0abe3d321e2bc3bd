// SPDX-License-Identifier: Apache-2.0
// Speed from positions, with its uncertainty and its delay.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "absenc/core/time.hpp"
#include "absenc/host/latch_time.hpp"

namespace absenc::host {

/// A speed with its uncertainty, both in thousandths of a count per second. The true speed is within `uncertainty` of
/// `speed`. An uncertainty of `most` states that the speed may be greater than can be represented.
struct MilliSpeed {
  /// Greatest value of `speed` and of `uncertainty`.
  static constexpr std::int64_t most = std::numeric_limits<std::int64_t>::max();
  std::int64_t speed = 0;        ///< Speed in counts per 1000 s, -`most` to `most`.
  std::int64_t uncertainty = 0;  ///< Uncertainty of `speed` in counts per 1000 s, 0 to `most`.
};

/// Mean speed between the newest position and an older one: at constant acceleration the speed in the middle of that
/// time. `uncertainty` covers the latch times and one count of each position, but no noise of the encoder. Firmware
/// uses `speed`, which needs integers only. Times must lie within 2^62 ns of the clock's start, and within 2^58 ns (9
/// years) of each other.
class Velocity {
 public:
  static constexpr std::size_t most_positions = 48;  ///< Greatest number of positions that are stored.
  /// The window grows to at most about this many times the desired length `window`. At this length it is used even if
  /// its speed is less certain.
  static constexpr int longest_windows = 20;

  /// Longest duration that can be desired as `window`; a longer one is reduced to it.
  static constexpr Time longest_window = std::chrono::minutes(2);

  /// Makes the calculation. `window`: desired time over which the speed is measured, above 0.
  explicit constexpr Velocity(Time window = std::chrono::milliseconds(50))
      : window_(window < longest_window ? window : longest_window) {}

  /// Adds a position of `Unwrapper`. A position that was not latched after the last stored one is not stored, and has
  /// no speed.
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
  /// Returns the mean speed and its uncertainty; 0 and 0 while `valid()` is false. The uncertainty includes the
  /// rounding of both, which is below 2^-29 of their sum plus 0.002 counts/s.
  [[nodiscard]] constexpr MilliSpeed speed() const {
    if (!valid()) return {};
    const std::uint64_t way = moved_from(start_);
    const std::int64_t fast = rate(way + 1, shortest_time(), Rounding::up);
    if (way == 0) return {0, fast};
    if (fast == MilliSpeed::most) return {moved() < 0 ? -fast : fast, MilliSpeed::most};
    const std::int64_t uncertainty = (fast - rate(way - 1, longest_time(), Rounding::down) + 1) / 2;
    const std::int64_t middle = fast - uncertainty;
    return {moved() < 0 ? -middle : middle, uncertainty};
  }
  /// Returns the mean speed in counts per second; 0 while `valid()` is false. Needs floating point.
  [[nodiscard]] constexpr double counts_per_second() const {
    if (!valid() || moved() == 0) return 0;
    const double middle = (fastest() + slowest()) / 2;
    return moved() < 0 ? -middle : middle;
  }
  /// Returns the uncertainty of `counts_per_second` in counts/s; 0 while `valid()` is false. Needs floating point.
  [[nodiscard]] constexpr double uncertainty() const { return valid() ? (fastest() - slowest()) / 2 : 0; }
  /// Returns the latch interval of the position that begins the window. Requires `valid()`.
  [[nodiscard]] constexpr const LatchTime& since() const { return positions_[start_].at; }
  /// Returns half the duration of the window; 0 while `valid()` is false.
  [[nodiscard]] constexpr Time delay() const { return valid() ? span(start_) / 2 : Time{}; }

 private:
  struct Sample {
    std::int64_t position;
    LatchTime at;
  };
  static constexpr std::size_t none = ~std::size_t{0};
  // A window of positions is certain enough if the position moved by this many counts in it, and if its length is this
  // many times the uncertainty of this length.
  static constexpr int enough = 20;
  // A window of the greatest length is used even if its length is only this many times the uncertainty of this length.
  static constexpr int least = 4;

  [[nodiscard]] constexpr const Sample& newest() const { return positions_[size_ - 1]; }
  [[nodiscard]] constexpr Time span(std::size_t start) const {
    return newest().at.middle() - positions_[start].at.middle();
  }
  [[nodiscard]] constexpr std::uint64_t moved_from(std::size_t start) const {
    const std::uint64_t way =
        static_cast<std::uint64_t>(newest().position) - static_cast<std::uint64_t>(positions_[start].position);
    return static_cast<std::int64_t>(way) < 0 ? 0 - way : way;
  }
  [[nodiscard]] constexpr std::int64_t moved() const {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(newest().position) -
                                     static_cast<std::uint64_t>(positions_[start_].position));
  }
  [[nodiscard]] constexpr Time shortest_time() const { return newest().at.earliest - positions_[start_].at.latest; }
  [[nodiscard]] constexpr Time longest_time() const { return newest().at.latest - positions_[start_].at.earliest; }

  enum class Rounding : bool { down, up };
  [[nodiscard]] static constexpr std::uint64_t halved(std::uint64_t value, Rounding rounding) {
    return (value >> 1) + (rounding == Rounding::up ? value & 1 : 0);
  }
  // Returns the speed in counts per 1000 s, at most MilliSpeed::most. A number of more than 31 bits is rounded by 2^-30
  // of its value at most.
  [[nodiscard]] static constexpr std::int64_t rate(std::uint64_t counts, Time time, Rounding rounding) {
    const Rounding opposite = rounding == Rounding::up ? Rounding::down : Rounding::up;
    // the result is in counts per 1000 s, and 1000 s are 10^12 ns = 5^12 * 2^12 ns
    constexpr std::uint64_t five_to_the_12th = 244'140'625;
    const std::uint64_t carry = rounding == Rounding::up ? 1 : 0;
    if (counts == 0) return 0;
    if (time <= Time{}) return MilliSpeed::most;
    int shift = 12;
    auto divisor = static_cast<std::uint64_t>(time.count());
    for (; divisor >> 32 != 0; --shift) divisor = halved(divisor, opposite);
    for (; counts >> 36 != 0; ++shift) counts = halved(counts, rounding);
    std::uint64_t product = counts * five_to_the_12th;
    const int zeros = std::countl_zero(product);
    product <<= zeros;
    shift -= zeros;
    // Rounds up with Rounding::up, since (a - 1) / b + 1 is a / b rounded up.
    const std::uint64_t quotient = (product - carry) / divisor + carry;
    constexpr auto most = static_cast<std::uint64_t>(MilliSpeed::most);
    std::uint64_t whole = most;
    if (shift < 0) whole = (shift > -64 ? (quotient - carry) >> -shift : 0) + carry;
    if (shift >= 0 && shift < 63 && quotient <= most >> shift) whole = quotient << shift;
    return static_cast<std::int64_t>(whole < most ? whole : most);
  }

  [[nodiscard]] static constexpr double per_second(double counts, Time time) {
    return counts * 1e9 / static_cast<double>(time.count());
  }
  // Fastest and slowest speed in counts/s that are possible: the true distance may be one count longer or shorter than
  // the measured one.
  [[nodiscard]] constexpr double fastest() const {
    return per_second(static_cast<double>(moved_from(start_)) + 1, shortest_time());
  }
  [[nodiscard]] constexpr double slowest() const {
    const std::uint64_t way = moved_from(start_);
    if (way == 0) return -fastest();
    return per_second(static_cast<double>(way) - 1, longest_time());
  }

  // Drops old positions, but keeps at least one that is as old as the longest window.
  constexpr void forget_old() {
    std::size_t old = 0;
    while (old + 2 < size_ && span(old + 1) >= longest_windows * window_) ++old;
    if (old != 0) remove(0, old);
  }

  // Removes one stored position, chosen so that old positions are stored at longer intervals than new ones.
  constexpr void thin_out() {
    std::size_t closest = 1;
    std::int64_t closest_gap = gap(1);
    std::int64_t closest_age = age(1);
    for (std::size_t i = 2; i + 1 < size_; ++i) {
      const std::int64_t one_gap = gap(i);
      const std::int64_t one_age = age(i);
      if (one_gap * closest_age >= closest_gap * one_age) continue;
      closest = i;
      closest_gap = one_gap;
      closest_age = one_age;
    }
    const bool drops_first = positions_[closest].at.width() > positions_[closest + 1].at.width();
    remove(drops_first || closest + 2 == size_ ? closest : closest + 1, 1);
  }
  // Gaps and ages of stored positions are computed in units of about 1 us, so that the product of two fits into 64
  // bits.
  [[nodiscard]] constexpr std::int64_t gap(std::size_t i) const {
    return (positions_[i + 1].at.middle() - positions_[i].at.middle()).count() >> 10;
  }
  [[nodiscard]] constexpr std::int64_t age(std::size_t i) const { return span(i).count() >> 10; }

  constexpr void remove(std::size_t first, std::size_t count) {
    for (std::size_t i = first + count; i < size_; ++i) positions_[i - count] = positions_[i];
    size_ -= count;
  }

  // Selects the shortest window of positions whose speed has a low enough uncertainty.
  constexpr void choose_start() {
    Time longer = size_ > 1 ? span(size_ - 2) : Time{};
    for (std::size_t i = size_ - 1; i-- > 0;) {
      const Time length = longer;
      longer = i > 0 ? span(i - 1) : length;  // length of the window that begins one position earlier, if there is one
      const bool fills_window = length >= window_ || longer > window_;
      if (!fills_window && i > 0) continue;
      const std::uint64_t way = moved_from(i);
      const bool is_resolved = way == 0 ? fills_window : way >= enough;
      // The length of the window may be wrong by this time, to either side.
      const Time open = (newest().at.width() + positions_[i].at.width()) / 2;
      const bool is_longest = length >= longest_windows * window_;
      if ((is_resolved && enough * open <= length) || (is_longest && least * open <= length)) {
        start_ = i;
        return;
      }
    }
  }

  Time window_;
  std::array<Sample, most_positions> positions_{};  // stored positions with their latch times, the oldest first
  std::size_t size_ = 0;
  std::size_t start_ = none;  // index of the stored position with which the selected window begins
};

}  // namespace absenc::host
