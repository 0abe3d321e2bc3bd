// SPDX-License-Identifier: Apache-2.0
// A small pseudo-random generator (splitmix64) with the same numbers on every platform.
#pragma once

#include <concepts>
#include <cstdint>

namespace absenc::sim {

/// A generator of pseudo-random numbers; not for secrets.
class Random {
 public:
  /// Makes a generator; the same seed gives the same numbers.
  explicit constexpr Random(std::uint64_t seed) : state_(seed) {}

  /// Returns 64 random bits.
  constexpr std::uint64_t next() {
    state_ += 0x9E3779B97F4A7C15;
    std::uint64_t mixed = state_;
    mixed = (mixed ^ (mixed >> 30)) * 0xBF58476D1CE4E5B9;
    mixed = (mixed ^ (mixed >> 27)) * 0x94D049BB133111EB;
    return mixed ^ (mixed >> 31);
  }

  /// Returns a number from 0 to limit - 1, each equally likely; `limit` must not be 0.
  template <std::unsigned_integral T>
  constexpr T below(T limit) {
    // Rejects the lowest 2^64 mod `limit` values, which would make some results more likely.
    const std::uint64_t uneven = (0 - std::uint64_t{limit}) % limit;
    std::uint64_t value = next();
    while (value < uneven) value = next();
    return static_cast<T>(value % limit);
  }
  /// The same for a limit that is written as a number; it must be above 0.
  constexpr std::uint64_t below(int limit) { return below(static_cast<std::uint64_t>(limit)); }

  /// Returns true with the given probability: 0 never, 1 always.
  constexpr bool chance(double probability) { return static_cast<double>(next() >> 11) * 0x1p-53 < probability; }

 private:
  std::uint64_t state_;
};

}  // namespace absenc::sim
