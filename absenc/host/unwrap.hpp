// SPDX-License-Identifier: Apache-2.0
// A position that goes on where the encoder's counter begins again: 64 bits from readings that follow each other.
#pragma once

#include <cstdint>

#include "absenc/core/angle.hpp"

namespace absenc::host {

/// How long a shaft of this speed takes for half of what the encoder counts: readings must be nearer to each other than
/// that. `never` when no speed is known (0).
[[nodiscard]] constexpr Time longest_gap(unsigned multiturn_bits, std::uint32_t maximum_rpm) {
  if (maximum_rpm == 0) return never;
  const double turns = multiturn_bits >= 63 ? 9.2e18 : static_cast<double>(std::uint64_t{1} << multiturn_bits);
  const double nanoseconds = turns / 2 * 60e9 / maximum_rpm;
  return nanoseconds < 9.2e18 ? Time(static_cast<std::int64_t>(nanoseconds)) : never;
}

/// Takes the shorter way round between two readings, so it is right as long as the shaft turns less than half of what
/// the encoder counts between them: half a revolution with a single-turn encoder. Faster than that it cannot know.
class Unwrapper {
 public:
  enum class Joined : std::uint8_t {
    ignored,    // the reading has no valid position
    started,    // the first one, or too late after the one before: the position is the encoder's own again
    continued,  // the way since the reading before was added
  };

  /// Readings that were latched further apart than `longest_gap` are not joined.
  explicit constexpr Unwrapper(Time longest_gap = never) : longest_gap_(longest_gap) {}

  constexpr Joined add(const Reading& reading) {
    if (!reading.ready || !reading.singleturn_valid()) return Joined::ignored;
    const bool joins = started_ && reading.latched - last_.latched <= longest_gap_;
    position_ = joins ? position_ + static_cast<std::uint64_t>(way(reading)) : absolute(reading);
    last_ = reading;
    started_ = true;
    return joins ? Joined::continued : Joined::started;
  }

  /// Counts of the single-turn resolution; at the start the encoder's own turns and counts.
  [[nodiscard]] constexpr std::int64_t position() const { return static_cast<std::int64_t>(position_); }

 private:
  [[nodiscard]] static constexpr unsigned turn_bits(const Reading& reading) {
    return reading.multiturn_valid && reading.singleturn_bits + reading.multiturn_bits <= 64 ? reading.multiturn_bits
                                                                                             : 0;
  }

  [[nodiscard]] static constexpr std::uint64_t absolute(const Reading& reading) {
    if (turn_bits(reading) == 0) return reading.singleturn;
    return reading.multiturn << reading.singleturn_bits | reading.singleturn;
  }

  [[nodiscard]] constexpr std::int64_t way(const Reading& reading) const {
    const bool with_turns = turn_bits(reading) != 0 && turn_bits(last_) != 0;
    const unsigned bits = reading.singleturn_bits + (with_turns ? reading.multiturn_bits : 0);
    const std::uint64_t to = with_turns ? absolute(reading) : reading.singleturn;
    const std::uint64_t from = with_turns ? absolute(last_) : last_.singleturn;
    return bits == 64 ? static_cast<std::int64_t>(to - from) : wrapped_difference(to, from, bits);
  }

  Time longest_gap_;
  bool started_ = false;
  std::uint64_t position_ = 0;  // unsigned: what overflows after 2^63 counts goes round
  Reading last_{};
};

}  // namespace absenc::host
