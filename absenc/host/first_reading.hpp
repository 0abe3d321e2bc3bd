// SPDX-License-Identifier: Apache-2.0
// Decides whether a position can be trusted: encoders can send well-formed wrong positions.
#pragma once

#include <cstdint>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/host/speed_limit.hpp"

namespace absenc::host {

/// A check that compares each position with the previous one, using the highest speed of the shaft.
class FirstReading {
 public:
  /// Makes a check for a shaft of at most `maximum_rpm` revolutions per minute; 0: the default of `SpeedLimit`.
  explicit constexpr FirstReading(std::uint32_t maximum_rpm)
      : FirstReading(Reach::of_shaft(maximum_rpm != 0 ? maximum_rpm : SpeedLimit{}.rpm)) {}
  /// Makes a check for a shaft or carriage that moves at most as far as `reach` states.
  explicit constexpr FirstReading(const Reach& reach) : reach_(reach) {}

  /// Forgets all stored positions.
  constexpr void start_again() {
    last_ = {};
    has_step_ = false;
  }

  /// Returns `is_near(reading)`, and stores the position of `reading` for the next comparison.
  constexpr bool confirms(const Reading& reading) {
    const bool agrees = is_near(reading);
    keep(reading);
    return agrees;
  }

  /// Returns whether `reading` has a position that can be compared: ready and valid.
  [[nodiscard]] static constexpr bool has_position(const Reading& reading) {
    return reading.ready && reading.singleturn_valid();
  }
  /// Returns whether a position is stored, with which the next one is compared.
  [[nodiscard]] constexpr bool has_last() const { return last_.bits != 0; }

  /// A position in counts, which includes the turns if they are valid and both fit in 64 bits.
  struct Place {
    std::uint64_t counts = 0;          ///< turns, if included, above the position within the turn
    std::uint8_t bits = 0;             ///< number of bits of `counts`; 0: there is no position
    std::uint8_t singleturn_bits = 0;  ///< those of them that are the position within the turn

    /// Returns whether `counts` includes the turns.
    [[nodiscard]] constexpr bool has_turns() const { return bits > singleturn_bits; }
    /// Returns whether both are positions in the same counts, so that they can be compared.
    [[nodiscard]] constexpr bool is_like(const Place& other) const {
      return bits != 0 && bits == other.bits && singleturn_bits == other.singleturn_bits;
    }
    /// Returns the distance of two positions that are alike, in the shorter direction.
    [[nodiscard]] constexpr std::uint64_t distance(const Place& other) const {
      return FirstReading::distance(counts - other.counts, bits);
    }
  };
  /// Returns the position of `reading`; one of 0 bits if it has none that can be compared.
  [[nodiscard]] static constexpr Place place_of(const Reading& reading) {
    if (!has_position(reading)) return {};
    const unsigned bits = reading.singleturn_bits;
    const unsigned all_bits = bits + reading.multiturn_bits;
    if (!reading.multiturn_valid || reading.multiturn_bits == 0 || all_bits > 64) {
      return {reading.singleturn, static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits)};
    }
    return {reading.multiturn << bits | reading.singleturn, static_cast<std::uint8_t>(all_bits),
            static_cast<std::uint8_t>(bits)};
  }
  /// Returns the largest distance of two positions of `bits` bits that can be judged: 15/32 of 2^bits counts.
  [[nodiscard]] static constexpr std::uint64_t most_judged(unsigned bits) {
    constexpr std::uint64_t share = 15;
    return bits >= 5 ? share << (bits - 5) : (share << bits) >> 5;
  }

  /// Returns whether `reading` is near enough to the position stored the time `between` before; false if none is
  /// stored.
  [[nodiscard]] constexpr bool is_near(const Reading& reading, Time between) const {
    const Place place = place_of(reading);
    if (!place.is_like(last_)) return false;
    const std::uint64_t step = place.counts - last_.counts;
    const std::uint64_t reached = reach(place, between);
    const std::uint64_t allowed = least(reached, most_judged(place.bits));
    const std::uint64_t moved = distance(step, place.bits);
    if (moved <= allowed) return true;
    if (!has_step_ || moved / most_excess > reached || distance(step_, place.bits) <= allowed) return false;
    return distance(step - step_, place.bits) <= least(allowed, most_judged(place.bits) / 8);
  }
  /// Returns `is_near` for the time between the latch times of the stored position and of `reading`.
  [[nodiscard]] constexpr bool is_near(const Reading& reading) const {
    return is_near(reading, reading.latched - latched_);
  }

  /// Returns whether `between` is short enough to judge the position of `reading`.
  [[nodiscard]] constexpr bool can_judge(const Reading& reading, Time between) const {
    const Place place = place_of(reading);
    return place.bits != 0 && reach(place, between) < most_judged(place.bits);
  }

  /// Stores the position of `reading` for the next comparison, or the fact that `reading` has none.
  constexpr void keep(const Reading& reading) {
    const Place place = place_of(reading);
    has_step_ = place.is_like(last_);
    step_ = place.counts - last_.counts;
    last_ = place;
    latched_ = reading.latched;
  }

 private:
  [[nodiscard]] static constexpr std::uint64_t least(std::uint64_t one, std::uint64_t other) {
    return one < other ? one : other;
  }
  // Returns the length of the movement `step` modulo 2^bits in the shorter direction.
  [[nodiscard]] static constexpr std::uint64_t distance(std::uint64_t step, unsigned bits) {
    return least(step & low_mask(bits), (0 - step) & low_mask(bits));
  }

  [[nodiscard]] constexpr std::uint64_t reach(const Place& place, Time between) const {
    constexpr std::uint64_t noise = 4;  // greatest noise of a position that is assumed, in counts
    const std::uint64_t counts = reach_.counts(between, place.singleturn_bits);
    return counts < ~noise ? counts + noise : counts;
  }

  Reach reach_;
  Place last_{};
  bool has_step_ = false;
  std::uint64_t step_ = 0;  // distance in counts from the second last position to the last one
  Time latched_{};
};

}  // namespace absenc::host
