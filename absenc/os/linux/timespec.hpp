// SPDX-License-Identifier: Apache-2.0
// Times as calls of the kernel take them.
#pragma once

#include <chrono>
#include <ctime>

#include "absenc/core/time.hpp"

namespace absenc::os {

/// Returns the time, which must not be negative, in seconds and nanoseconds.
[[nodiscard]] inline timespec to_timespec(Time time) {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(time);
  timespec converted{};  // on 32-bit machines, its members are shorter than those of Time
  converted.tv_sec = static_cast<decltype(converted.tv_sec)>(seconds.count());
  converted.tv_nsec = static_cast<decltype(converted.tv_nsec)>((time - seconds).count());
  return converted;
}

}  // namespace absenc::os
