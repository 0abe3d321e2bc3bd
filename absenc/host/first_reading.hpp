// SPDX-License-Identifier: Apache-2.0
// Encoders send well-formed nonsense while they start: the first position to trust is the second of two that agree.
#pragma once

#include <cstdint>

#include "absenc/core/angle.hpp"

namespace absenc::host {

class FirstReading {
 public:
  /// 0: no limit is known, only validity counts.
  explicit constexpr FirstReading(std::uint32_t maximum_rpm) : maximum_rpm_(maximum_rpm) {}

  constexpr void start_again() { has_last_ = false; }

  /// Whether `reading` is ready, valid and as near to the one before as the fastest shaft allows.
  constexpr bool confirms(const Reading& reading) {
    if (!reading.ready || !reading.singleturn_valid()) {
      has_last_ = false;
      return false;
    }
    const bool agrees = has_last_ && is_near(reading);
    last_ = reading;
    has_last_ = true;
    return agrees;
  }

 private:
  [[nodiscard]] constexpr bool is_near(const Reading& reading) const {
    if (maximum_rpm_ == 0) return true;
    const unsigned bits = reading.singleturn_bits;
    std::int64_t moved = wrapped_difference(reading.singleturn, last_.singleturn, bits);
    const unsigned all_bits = bits + reading.multiturn_bits;
    if (reading.multiturn_valid && last_.multiturn_valid && all_bits < 64) {
      moved = wrapped_difference(reading.multiturn << bits | reading.singleturn,
                                 last_.multiturn << bits | last_.singleturn, all_bits);
    }
    // Counts within the time between, and a little for noise. double: 2^40 counts times a minute is no integer affair.
    const double minutes = static_cast<double>((reading.latched - last_.latched).count()) / 60e9;
    const double allowed = 4.0 + maximum_rpm_ * minutes * static_cast<double>(std::uint64_t{1} << bits);
    const auto distance = static_cast<double>(moved < 0 ? -moved : moved);
    return distance <= allowed;
  }

  std::uint32_t maximum_rpm_;
  bool has_last_ = false;
  Reading last_{};
};

}  // namespace absenc::host
