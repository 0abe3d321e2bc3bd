// SPDX-License-Identifier: Apache-2.0
// The clock of all ports, and waits that Ctrl-C ends.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "absenc/core/time.hpp"

namespace absenc::os {

/// Makes SIGINT and SIGTERM end the waits of this file and of the ports. Throws Failure.
void catch_interrupts();

/// Returns whether SIGINT or SIGTERM was received since `catch_interrupts`.
[[nodiscard]] bool interrupted();

/// Returns a descriptor that is readable after SIGINT or SIGTERM; -1 before `catch_interrupts` was called.
[[nodiscard]] int interrupt_descriptor();
/// Makes `interrupt_descriptor` unreadable again. Returns false if no signal was pending.
bool take_interrupt();

/// A function that can end the waits of the current thread: a wait throws Ended if the function returns true. A wait
/// calls it after each 20 ms without an event.
class CancelCheck {
 public:
  /// `over` is the function; it must outlive the object. An empty function is never called.
  explicit CancelCheck(const std::function<bool()>& over);
  ~CancelCheck();
  CancelCheck(const CancelCheck&) = delete;
  CancelCheck& operator=(const CancelCheck&) = delete;

  /// Returns how long a wait may take before it must call `check`; `never` if this thread has no CancelCheck.
  [[nodiscard]] static Time interval();
  /// Calls the function of the newest CancelCheck of this thread. Throws Ended if it returns true.
  static void check();

 private:
  const std::function<bool()>* outer_;
};

/// Returns the time of the system's monotonic clock (Linux: CLOCK_MONOTONIC).
[[nodiscard]] Time now();

inline constexpr std::size_t most_watched = 32;

/// Directions in which a descriptor is ready: can be read or written without blocking. One that is closed at the other
/// end, or has an error, counts as ready to be read.
struct Ready {
  bool to_read = false;
  bool to_write = false;
};

/// A descriptor that `wait_for` watches.
struct Watched {
  int descriptor = -1;  // descriptor to be watched; -1: none
  Ready wanted{.to_read = true};
  Ready ready{};  // set by `wait_for`; `to_read` also if it was not wanted but the other end is closed
};

/// Blocks until a descriptor in `watched` (at most `most_watched`) is ready, and returns true; returns false if
/// `deadline` is reached first. Throws Interrupted, Ended and Failure.
bool wait_for(std::span<Watched> watched, Time deadline);

/// Sleeps until `time` or somewhat longer, never shorter. Throws as `wait_for` does.
void sleep_until(Time time);

/// Sleeps until `time`, and polls the clock for the last 100 us. Throws as `wait_for` does.
void reach(Time time);

}  // namespace absenc::os
