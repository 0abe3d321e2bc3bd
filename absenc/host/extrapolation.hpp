// SPDX-License-Identifier: Apache-2.0
// Position at the instant of a control loop, from the last two readings.
#pragma once

#include <cstdint>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"

namespace absenc::host {

/// Extrapolates the position of a shaft at the mean speed between the last two valid readings.
///
/// At an acceleration a, a position `ahead` of the last reading is wrong by at most a * ahead * (ahead + span) / 2, and
/// by the noise of the readings times 1 + 2 * ahead / span; `span` is the time between the two readings.
class Extrapolation {
 public:
  /// Adds a reading. Ignores a reading that is not ready, not valid or wider than 63 bits. Forgets the earlier ones if
  /// the width differs or `reading` was not latched later.
  constexpr void add(const Reading& reading) {
    if (!reading.ready || !reading.singleturn_valid()) return;
    const unsigned turn_bits = reading.multiturn_valid ? reading.multiturn_bits : 0;
    const unsigned bits = reading.singleturn_bits + turn_bits;
    if (bits > most_bits) return;
    const std::uint64_t now =
        turn_bits != 0 ? reading.multiturn << reading.singleturn_bits | reading.singleturn : reading.singleturn;
    const bool continues = bits_ == bits && reading.latched > latched_;
    step_ = continues ? with_sign(now - position_, bits) : 0;
    span_ = continues ? reading.latched - latched_ : Time{};
    position_ = now;
    latched_ = reading.latched;
    bits_ = bits;
  }
  /// Forgets all readings, for use after a pause.
  constexpr void restart() { bits_ = 0; }

  /// Returns whether two readings are known.
  [[nodiscard]] constexpr bool valid() const { return bits_ != 0 && span_ > Time{}; }
  /// Returns the width in bits of the positions that `at` returns: single-turn bits and, if they are valid, those of
  /// the turns.
  [[nodiscard]] constexpr unsigned bits() const { return bits_; }
  /// Returns the position at `time`, the turns above the single-turn counts, as the encoder would count it. Call it
  /// only while `valid()` is true.
  [[nodiscard]] constexpr std::uint64_t at(Time time) const {
    return (position_ + moved(time - latched_)) & low_mask(bits_);
  }

 private:
  static constexpr unsigned most_bits = 63;

  // Returns the movement in the time `ahead`: step_ * ahead / span_ modulo 2^64, rounded towards zero. Both times are
  // halved until the product fits.
  [[nodiscard]] constexpr std::uint64_t moved(Time ahead) const {
    constexpr std::int64_t most = std::int64_t{1} << 31;
    std::int64_t time = ahead.count();
    std::int64_t span = span_.count();
    while (span >= most || time >= most || time <= -most) {
      span /= 2;
      time /= 2;
    }
    if (span == 0) return 0;
    if (step_ < most && step_ > -most) return static_cast<std::uint64_t>(step_ * time / span);
    return static_cast<std::uint64_t>(step_ / span) * static_cast<std::uint64_t>(time);
  }

  std::uint64_t position_ = 0;
  std::int64_t step_ = 0;  // distance in counts from the second last reading to the last one
  Time span_{};            // time from the second last reading to the last one
  Time latched_{};
  unsigned bits_ = 0;  // width of the last position in bits; 0: no reading is known
};

}  // namespace absenc::host
