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
  Time after{};     // os::now after that
};

/// Reads both clocks; of several attempts returns the quickest, mostly below 1 us. After a pause of the thread between
/// the readings, `after - before` is longer.
[[nodiscard]] ClockPair read_clocks();

/// A time of os::now, as in Event: the event may have been earlier by up to `late`.
struct StampedTime {
  Time at{};
  Time late{};
};

/// Converts stamps that the kernel made since the queue of frames was empty.
///
/// The two clocks differ by a constant, because the kernel slews them together, until somebody sets the calendar clock
/// or the machine was suspended. If the constant changed since the queue was empty, a stamp may be of before or after
/// the change, and only the queue limits the time.
class StampClock {
 public:
  /// `clocks` were read before a look that found the queue empty.
  explicit StampClock(const ClockPair& clocks) : empty_(clocks) {}
  void found_empty(const ClockPair& clocks) { empty_ = clocks; }

  /// Converts the stamp of a frame that was taken from the queue between `before` and `after`. `late` is mostly below
  /// 1 us. `late` is the time since the queue was empty if there is no stamp, if the clocks show that the calendar
  /// clock was set meanwhile, or if the stamp is too old, or was made during the read, as the kernel does until it has
  /// switched stamps on.
  [[nodiscard]] StampedTime convert(std::optional<Time> stamp, const ClockPair& before, const ClockPair& after) const {
    const StampedTime by_queue{after.before, after.before - empty_.before};
    const bool was_set = least(empty_) > greatest(after) || least(after) > greatest(empty_);
    if (!stamp || was_set) return by_queue;
    const Time latest = *stamp - std::min(least(empty_), least(after));
    const Time earliest = *stamp - std::max(greatest(empty_), greatest(after));
    // A frame may wait this long between its stamp and the queue.
    constexpr Time way_to_queue = std::chrono::milliseconds(10);
    if (latest >= before.before || latest < empty_.before - way_to_queue) return by_queue;
    return {latest, latest - earliest};
  }

 private:
  // Bounds of the calendar clock's lead over os::now.
  [[nodiscard]] static Time least(const ClockPair& clocks) { return clocks.calendar - clocks.after; }
  [[nodiscard]] static Time greatest(const ClockPair& clocks) { return clocks.calendar - clocks.before; }

  ClockPair empty_;
};

}  // namespace absenc::os
