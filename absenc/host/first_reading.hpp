// SPDX-License-Identifier: Apache-2.0
// Encoders send well-formed nonsense while they start, and no check sees all damage: the position to trust is the
// second of two that agree.
#pragma once

#include <cstdint>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/host/speed_limit.hpp"

namespace absenc::host {

/// Compares each position with the one before: no shaft gets farther than its fastest in the time between. Where the
/// fastest gets farther than half of what the encoder counts, less a sixteenth, only a position that is farther away
/// than that is refused. A shaft that is faster, by `most_excess` at the most, is seen by its third position, which is
/// as far from the second as that from the first.
class FirstReading {
 public:
  /// 0: nobody says it, which counts as the usual limit of `SpeedLimit`.
  explicit constexpr FirstReading(std::uint32_t maximum_rpm)
      : FirstReading(Reach::of_shaft(maximum_rpm != 0 ? maximum_rpm : SpeedLimit{}.rpm)) {}
  /// Accepts readings that the shaft can reach.
  explicit constexpr FirstReading(const Reach& reach) : reach_(reach) {}

  /// Forgets all readings.
  constexpr void start_again() {
    last_ = {};
    has_step_ = false;
  }

  /// Whether `reading` is ready, valid and as near to the one before as the fastest shaft allows. The next is compared
  /// with this one.
  constexpr bool confirms(const Reading& reading) {
    const bool agrees = is_near(reading);
    keep(reading);
    return agrees;
  }

  /// Whether it has a position that can be compared: ready and valid.
  [[nodiscard]] static constexpr bool has_position(const Reading& reading) {
    return reading.ready && reading.singleturn_valid();
  }
  /// Whether there is one before.
  [[nodiscard]] constexpr bool has_last() const { return last_.bits != 0; }

  /// `between` is how long they can have been apart.
  [[nodiscard]] constexpr bool is_near(const Reading& reading, Time between) const {
    const Place place = place_of(reading);
    if (!is_like_last(place)) return false;
    const std::uint64_t step = place.counts - last_.counts;
    const std::uint64_t reached = reach(place, between);
    const std::uint64_t allowed = least(reached, most_told(place.bits));
    const std::uint64_t moved = distance(step, place.bits);
    if (moved <= allowed) return true;
    if (!has_step_ || moved / most_excess > reached || distance(step_, place.bits) <= allowed) return false;
    return distance(step - step_, place.bits) <= least(allowed, most_told(place.bits) / 8);
  }
  /// Returns whether the shaft can have moved to `reading` since the one before.
  [[nodiscard]] constexpr bool is_near(const Reading& reading) const {
    return is_near(reading, reading.latched - latched_);
  }

  /// Whether the limit tells anything of readings that are so far apart: whether it excludes any position that is not
  /// half the range away.
  [[nodiscard]] constexpr bool tells(const Reading& reading, Time between) const {
    const Place place = place_of(reading);
    return place.bits != 0 && reach(place, between) < most_told(place.bits);
  }

  /// The next is compared with this one. One without a position starts it again.
  constexpr void keep(const Reading& reading) {
    const Place place = place_of(reading);
    has_step_ = is_like_last(place);
    step_ = place.counts - last_.counts;
    last_ = place;
    latched_ = reading.latched;
  }

 private:
  // With the turns, where they hold.
  struct Place {
    std::uint64_t counts = 0;
    std::uint8_t bits = 0;  // 0: none
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
  // The shorter way round.
  [[nodiscard]] static constexpr std::uint64_t distance(std::uint64_t step, unsigned bits) {
    return least(step & low_mask(bits), (0 - step) & low_mask(bits));
  }

  [[nodiscard]] constexpr std::uint64_t reach(const Place& place, Time between) const {
    constexpr std::uint64_t noise = 4;  // counts
    const std::uint64_t counts = reach_.counts(between, place.singleturn_bits);
    return counts < ~noise ? counts + noise : counts;
  }
  // 15/32 of the range, as in longest_gap.
  [[nodiscard]] static constexpr std::uint64_t most_told(unsigned bits) {
    constexpr std::uint64_t share = 15;
    return bits >= 5 ? share << (bits - 5) : (share << bits) >> 5;
  }

  Reach reach_;
  Place last_{};
  bool has_step_ = false;
  std::uint64_t step_ = 0;  // to it from the one before
  Time latched_{};
};

}  // namespace absenc::host
