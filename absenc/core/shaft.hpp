// SPDX-License-Identifier: Apache-2.0
// Position and motion of a shaft, which a virtual encoder measures.
#pragma once

#include <cstdint>

#include "absenc/core/time.hpp"

namespace absenc {

/// Position and motion of a shaft at one time.
struct ShaftState {
  /// Position in units of 2^-32 revolution.
  std::int64_t position = 0;
  std::int32_t speed_millirpm = 0;  ///< speed in 1/1000 revolutions per minute, counter-clockwise positive
  std::int32_t acceleration = 0;    ///< angular acceleration in rad/s^2
};

/// A shaft whose motion is a function of time. Implementations accept any times, in any order.
struct Shaft {
  /// Returns position and motion of the shaft at `time`.
  [[nodiscard]] virtual ShaftState at(Time time) const = 0;

 protected:
  ~Shaft() = default;
};

}  // namespace absenc
