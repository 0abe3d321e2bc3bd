// SPDX-License-Identifier: Apache-2.0
// The one clock type: nanoseconds since whatever start the caller chose. No layer below `os` reads a clock.
#pragma once

// Of <chrono> durations alone, without calendars and time zones: half a second for everybody who includes this.
#if __has_include(<bits/chrono.h>)
#include <bits/chrono.h>  // libstdc++
#else
#include <chrono>
#endif

namespace absenc {

using Time = std::chrono::nanoseconds;

inline constexpr Time never = Time::max();

// As two numbers: those of chrono come by way of <=>, which on a small core is a call, and three instructions without.
[[nodiscard]] constexpr bool operator<(Time one, Time other) { return one.count() < other.count(); }
[[nodiscard]] constexpr bool operator>(Time one, Time other) { return one.count() > other.count(); }
[[nodiscard]] constexpr bool operator<=(Time one, Time other) { return one.count() <= other.count(); }
[[nodiscard]] constexpr bool operator>=(Time one, Time other) { return one.count() >= other.count(); }

}  // namespace absenc
