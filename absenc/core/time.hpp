// SPDX-License-Identifier: Apache-2.0
// The one clock type: nanoseconds since whatever start the caller chose. No layer below `os` reads a clock.
#pragma once

#include <chrono>

namespace absenc {

using Time = std::chrono::nanoseconds;

inline constexpr Time never = Time::max();

}  // namespace absenc
