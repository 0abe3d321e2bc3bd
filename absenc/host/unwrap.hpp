// SPDX-License-Identifier: Apache-2.0
// Continuous position: a counter of 64 bits from consecutive readings.
#pragma once

#include <bit>
#include <cstdint>

#include "absenc/core/angle.hpp"
#include "absenc/host/apart.hpp"
#include "absenc/host/latch_time.hpp"
#include "absenc/host/speed_limit.hpp"

namespace absenc::host {

/// A continuous position, from readings in which the encoder's own counter wraps. It uses integers only. Times must lie
/// within 2^62 ns of the clock's start, and within 2^58 ns (9 years) of each other. The position wraps after 2^63
/// counts.
class Unwrapper {
 public:
  /// How a reading was joined to the continuous position.
  enum class Joined : std::uint8_t {
    ignored,    ///< the reading has no valid position
    started,    ///< the first reading with a position: the continuous position starts with the encoder's own
    continued,  ///< the distance since the last valid position was added
    restarted,  ///< the distance is not sure after a long pause: the position starts again with the encoder's own
  };

  /// Makes a continuous position of a shaft or carriage that keeps to `limit`. `times` is the meaning of
  /// Reading::latched.
  explicit constexpr Unwrapper(const SpeedLimit& limit = {}, Times times = Times::latched)
      : limit_(limit), reach_(Reach::of_shaft(limit.rpm)), times_(times), apart_(times) {}

  /// Adds `reading`, whose latch interval follows from its own times. Returns how it was joined.
  constexpr Joined add(const Reading& reading) { return add(reading, latch_time(reading)); }
  /// Adds `reading`, which was latched in the interval `at`. Returns how it was joined.
  constexpr Joined add(const Reading& reading, const LatchTime& at) {
    if (!has_position(reading)) return Joined::ignored;
    const bool first = !started_;
    const bool joins = !first && is_near(reading) && are_surely_near(reading, at);
    if (!joins) counts_turns_ = turn_bits(reading) != 0;
    position_ = joins ? position_ + static_cast<std::uint64_t>(way(reading)) : absolute(reading);
    apart_.add(reading.latched);
    reach_ = reach_of(reading);
    last_ = reading;
    last_at_ = at;
    started_ = true;
    return first ? Joined::started : joins ? Joined::continued : Joined::restarted;
  }

  /// Returns whether `reading` is a jump from the last added reading; false if this cannot be known.
  [[nodiscard]] constexpr bool jumps(const Reading& reading) const {
    if (!started_ || !has_position(reading)) return false;
    constexpr Time vague{1'000'000};    // assumed uncertainty of the latch time: 1 ms
    constexpr std::uint64_t noise = 4;  // assumed noise of a position, in counts
    const Reach reach = reach_of(reading).at_excess(most_excess);
    const auto step = static_cast<std::uint64_t>(way(reading));
    // After a long pause `way` is not sure, but `reach` is longer then than any way, so the reading is no jump.
    const std::uint64_t moved = way(reading) < 0 ? 0 - step : step;
    return moved > noise && moved - noise > reach.counts(apart(reading) + vague, reading.singleturn_bits);
  }

  /// Returns the continuous position in counts of the single-turn resolution.
  [[nodiscard]] constexpr std::int64_t position() const { return static_cast<std::int64_t>(position_); }

  /// Returns whether the continuous position started with turns that the encoder counts.
  [[nodiscard]] constexpr bool counts_turns() const { return counts_turns_; }

 private:
  [[nodiscard]] static constexpr bool has_position(const Reading& reading) {
    return reading.ready && reading.singleturn_valid();
  }

  [[nodiscard]] static constexpr unsigned turn_bits(const Reading& reading) {
    return reading.multiturn_valid && reading.singleturn_bits + reading.multiturn_bits <= 64 ? reading.multiturn_bits
                                                                                             : 0;
  }

  [[nodiscard]] static constexpr std::uint64_t absolute(const Reading& reading) {
    if (turn_bits(reading) == 0) return reading.singleturn;
    return static_cast<std::uint64_t>(reading.turns()) << reading.singleturn_bits | reading.singleturn;
  }

  [[nodiscard]] constexpr bool have_turns(const Reading& reading) const {
    return turn_bits(reading) != 0 && turn_bits(last_) != 0;
  }

  // Returns the resolution of `reading`, with its turns only if the last reading has turns, too.
  [[nodiscard]] constexpr Resolution resolution_of(const Reading& reading) const {
    return {reading.singleturn_bits, have_turns(reading) ? reading.multiturn_bits : 0, reading.unit_um};
  }
  // Calculates the reach anew only if the length of a count differs from the last reading's, because that takes long.
  [[nodiscard]] constexpr Reach reach_of(const Reading& reading) const {
    const bool same = std::bit_cast<std::uint64_t>(reading.unit_um) == std::bit_cast<std::uint64_t>(last_.unit_um);
    return same ? reach_ : Reach::of(limit_, {.unit_um = reading.unit_um});
  }
  // Returns which part of the counted range the position can have moved in the time `between`, times 2^32.
  [[nodiscard]] constexpr std::uint64_t share(const Reading& reading, Time between) const {
    return reach_of(reading).share(between, resolution_of(reading));
  }
  // half the range that the encoder counts, in units of 2^-32 of this range
  static constexpr std::uint64_t half = std::uint64_t{1} << 31;

  // Returns whether the shaft can have moved by at most 15/16 of half the counted range since the last reading;
  // `longest_gap` has the same limit.
  [[nodiscard]] constexpr bool is_near(const Reading& reading) const {
    return share(reading, apart(reading)) < half / 16 * 15;
  }

  // Returns whether the shaft surely moved less than half the counted range. No margin is subtracted from this half,
  // because the interval `at` already contains the unknown latch time.
  [[nodiscard]] constexpr bool are_surely_near(const Reading& reading, const LatchTime& at) const {
    return times_ == Times::arrived || share(reading, at.latest - last_at_.earliest) < half;
  }

  [[nodiscard]] constexpr Time apart(const Reading& reading) const { return apart_.since_last(reading.latched); }

  [[nodiscard]] constexpr std::int64_t way(const Reading& reading) const {
    const bool with_turns = have_turns(reading);
    const unsigned bits = reading.singleturn_bits + (with_turns ? reading.multiturn_bits : 0);
    const std::uint64_t to = with_turns ? absolute(reading) : reading.singleturn;
    const std::uint64_t from = with_turns ? absolute(last_) : last_.singleturn;
    return bits == 64 ? static_cast<std::int64_t>(to - from) : wrapped_difference(to, from, bits);
  }

  SpeedLimit limit_;
  // distances that are possible within the speed limit, for counts of the length that the last reading has
  Reach reach_;
  Times times_;
  Apart apart_;
  bool started_ = false;
  bool counts_turns_ = false;
  // the continuous position, stored as an unsigned number, so that its wrap after 2^63 counts is defined
  std::uint64_t position_ = 0;
  Reading last_{};
  LatchTime last_at_{};
};

}  // namespace absenc::host
