// SPDX-License-Identifier: Apache-2.0
// Decides whether a position can be trusted. Encoders send well-formed wrong positions while they start, and no
// checksum detects all damage: a position is trusted when it is near enough to the one before.
#pragma once

#include <cstdint>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/host/speed_limit.hpp"

namespace absenc::host {

/// A check that compares each position with the position before: at its highest speed the shaft must be able to move
/// from one to the other in the time between them. If it can move farther than 15/32 of the counted range in that time,
/// every position up to 15/32 away is accepted. A movement that is too fast by a factor of `most_excess` at most is
/// accepted if the movement before it was too fast as well, and nearly the same.
class FirstReading {
 public:
  /// Makes a check for a shaft of at most `maximum_rpm` revolutions per minute; 0: unknown, so the default of
  /// `SpeedLimit` applies.
  explicit constexpr FirstReading(std::uint32_t maximum_rpm)
      : FirstReading(Reach::of_shaft(maximum_rpm != 0 ? maximum_rpm : SpeedLimit{}.rpm)) {}
  /// Makes a check for a shaft or carriage that moves at most as far as `reach` states.
  explicit constexpr FirstReading(const Reach& reach) : reach_(reach) {}

  /// Forgets all stored positions.
  constexpr void start_again() {
    last_ = {};
    has_step_ = false;
  }

  /// Returns whether `reading` is ready and valid, and near enough to the stored position; false if no position is
  /// stored. Then calls `keep` with `reading`.
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

  /// Returns whether the position of `reading` is accepted after the stored one and the time `between`, by the rules of
  /// the class. False if no position is stored, if `reading` has none, or if their numbers of bits differ.
  [[nodiscard]] constexpr bool is_near(const Reading& reading, Time between) const {
    const Place place = place_of(reading);
    if (!is_like_last(place)) return false;
    const std::uint64_t step = place.counts - last_.counts;
    const std::uint64_t reached = reach(place, between);
    const std::uint64_t allowed = least(reached, most_judged(place.bits));
    const std::uint64_t moved = distance(step, place.bits);
    if (moved <= allowed) return true;
    if (!has_step_ || moved / most_excess > reached || distance(step_, place.bits) <= allowed) return false;
    return distance(step - step_, place.bits) <= least(allowed, most_judged(place.bits) / 8);
  }
  /// Returns `is_near(reading, between)` for the time between the latch times of the stored position and of `reading`.
  [[nodiscard]] constexpr bool is_near(const Reading& reading) const {
    return is_near(reading, reading.latched - latched_);
  }

  /// Returns whether even at its highest speed the shaft moves by less than 15/32 of the counted range in the time
  /// `between`; false if `reading` has no position.
  [[nodiscard]] constexpr bool can_judge(const Reading& reading, Time between) const {
    const Place place = place_of(reading);
    return place.bits != 0 && reach(place, between) < most_judged(place.bits);
  }

  /// Stores the position of `reading` for the next comparison. A reading without a position clears the stored position.
  constexpr void keep(const Reading& reading) {
    const Place place = place_of(reading);
    has_step_ = is_like_last(place);
    step_ = place.counts - last_.counts;
    last_ = place;
    latched_ = reading.latched;
  }

 private:
  // A position in counts, with the turns if they are valid and fit in 64 bits together with it.
  struct Place {
    std::uint64_t counts = 0;
    std::uint8_t bits = 0;  // number of bits of `counts`; 0: no position
    std::uint8_t singleturn_bits = 0;
  };

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

  [[nodiscard]] constexpr bool is_like_last(const Place& place) const {
    return place.bits != 0 && place.bits == last_.bits && place.singleturn_bits == last_.singleturn_bits;
  }

  [[nodiscard]] static constexpr std::uint64_t least(std::uint64_t one, std::uint64_t other) {
    return one < other ? one : other;
  }
  // Returns the length of the movement `step` in a counted range of 2^bits counts, in the shorter of both directions.
  [[nodiscard]] static constexpr std::uint64_t distance(std::uint64_t step, unsigned bits) {
    return least(step & low_mask(bits), (0 - step) & low_mask(bits));
  }

  [[nodiscard]] constexpr std::uint64_t reach(const Place& place, Time between) const {
    constexpr std::uint64_t noise = 4;  // noise of a position, in counts
    const std::uint64_t counts = reach_.counts(between, place.singleturn_bits);
    return counts < ~noise ? counts + noise : counts;
  }
  // Returns the largest distance that can be judged: 15/32 of the counted range, as in longest_gap.
  [[nodiscard]] static constexpr std::uint64_t most_judged(unsigned bits) {
    constexpr std::uint64_t share = 15;
    return bits >= 5 ? share << (bits - 5) : (share << bits) >> 5;
  }

  Reach reach_;
  Place last_{};
  bool has_step_ = false;
  std::uint64_t step_ = 0;  // counts from the second last position to the last one
  Time latched_{};
};

}  // namespace absenc::host
