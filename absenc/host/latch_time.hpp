// SPDX-License-Identifier: Apache-2.0
// Interval in which a position was latched, as far as host and line can know it.
#pragma once

#include "absenc/core/angle.hpp"
#include "absenc/core/time.hpp"

namespace absenc::host {

/// The interval in which a position was latched, as far as it is known.
struct LatchTime {
  Time earliest{};  ///< Earliest time at which the position can have been latched.
  Time latest{};    ///< Latest time at which the position can have been latched.

  /// Returns the middle of the latch interval.
  [[nodiscard]] constexpr Time middle() const { return earliest + (latest - earliest) / 2; }
  /// Returns the length of the latch interval.
  [[nodiscard]] constexpr Time width() const { return latest - earliest; }
};

/// Returns the latch interval that follows from the times in `reading` alone.
[[nodiscard]] constexpr LatchTime latch_time(const Reading& reading) {
  return {reading.latched, reading.received > reading.latched ? reading.received : reading.latched};
}

}  // namespace absenc::host
