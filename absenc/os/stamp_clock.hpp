// SPDX-License-Identifier: Apache-2.0
// Converts the kernel's time stamps of received frames, which are calendar time, to times of os::now.
#pragma once

#include <algorithm>
#include <optional>

#include "absenc/core/time.hpp"

namespace absenc::os {

/// The calendar clock (CLOCK_REALTIME), read between two readings of os::now.
struct ClockPair {
  Time before{};    // os::now before the calendar clock was read
  Time calendar{};  // time of CLOCK_REALTIME since 1970
  Time after{};     // os::now after the calendar clock was read
};

/// Reads both clocks several times and returns the attempt with the smallest `after - before`, mostly below 1 us. The
/// difference is greater if the thread was interrupted in every attempt.
[[nodiscard]] ClockPair read_clocks();

/// A time of os::now, as in Event: the event happened at `at` or earlier by up to `late`.
struct StampedTime {
  Time at{};
  Time late{};
};

/// Converts stamps that the kernel made since the queue of frames was empty.
///
/// The calendar clock and os::now differ by a constant, because the kernel slews them together. The constant changes
/// when the calendar clock is set or the machine is suspended. If it changed since the queue was empty, a stamp may
/// have been made before or after the change; the frame is then only known to have arrived since the queue was empty.
class StampClock {
 public:
  /// `clocks` were read before a read that found the queue of frames empty.
  explicit StampClock(const ClockPair& clocks) : empty_(clocks) {}
  void found_empty(const ClockPair& clocks) { empty_ = clocks; }

  /// Converts the stamp of a frame that was taken from the queue between `before` and `after`. StampedTime::late is
  /// mostly below 1 us. It is the time since the queue was empty if there is no stamp, if the clocks show that the
  /// calendar clock was set meanwhile, if the stamp is too old, or if the kernel made the stamp during the read, as
  /// it does until it has switched stamps on.
  [[nodiscard]] StampedTime convert(std::optional<Time> stamp, const ClockPair& before, const ClockPair& after) const {
    const StampedTime by_queue{after.before, after.before - empty_.before};
    const bool was_set = least(empty_) > greatest(after) || least(after) > greatest(empty_);
    if (!stamp || was_set) return by_queue;
    const Time latest = *stamp - std::min(least(empty_), least(after));
    const Time earliest = *stamp - std::max(greatest(empty_), greatest(after));
    // Longest time between the stamp of a frame and its arrival in the queue.
    constexpr Time way_to_queue = std::chrono::milliseconds(10);
    if (latest >= before.before || latest < empty_.before - way_to_queue) return by_queue;
    return {latest, latest - earliest};
  }

 private:
  // Bounds of the difference between the calendar clock and os::now.
  [[nodiscard]] static Time least(const ClockPair& clocks) { return clocks.calendar - clocks.after; }
  [[nodiscard]] static Time greatest(const ClockPair& clocks) { return clocks.calendar - clocks.before; }

  ClockPair empty_;
};

}  // namespace absenc::os
