// SPDX-License-Identifier: Apache-2.0
// The type of protocol time: nanoseconds since a start that the caller chooses.
#pragma once

// Includes libstdc++'s <bits/chrono.h>, which lacks the calendars and time zones, because those are slow to compile.
#if __has_include(<bits/chrono.h>)
#include <bits/chrono.h>
#else
#include <chrono>
#endif

namespace absenc {

/// A time since the start of a clock, or a duration, in nanoseconds.
using Time = std::chrono::nanoseconds;

inline constexpr Time never = Time::max();  ///< A time that is never reached.

/// Returns whether `one` is before `other`.
[[nodiscard]] constexpr bool operator<(Time one, Time other) { return one.count() < other.count(); }
/// Returns whether `one` is after `other`.
[[nodiscard]] constexpr bool operator>(Time one, Time other) { return one.count() > other.count(); }
/// Returns whether `one` is before or equal to `other`.
[[nodiscard]] constexpr bool operator<=(Time one, Time other) { return one.count() <= other.count(); }
/// Returns whether `one` is after or equal to `other`.
[[nodiscard]] constexpr bool operator>=(Time one, Time other) { return one.count() >= other.count(); }

}  // namespace absenc
