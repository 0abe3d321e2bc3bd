// SPDX-License-Identifier: Apache-2.0
// The clock of all ports, and waits that Ctrl-C ends.
#pragma once

#include <poll.h>

#include <cstddef>
#include <functional>
#include <span>

#include "absenc/core/time.hpp"

namespace absenc::os {

/// Makes SIGINT and SIGTERM end the waits of this file and of the ports, even if the parent process ignored them (as a
/// shell does for background programs). Call it early in main; further calls change nothing. Throws Failure.
void catch_interrupts();

/// Returns whether SIGINT or SIGTERM was received since `catch_interrupts`, for loops that never wait.
[[nodiscard]] bool interrupted();

/// Returns a descriptor that is readable after SIGINT or SIGTERM; -1 before `catch_interrupts`.
[[nodiscard]] int interrupt_descriptor();
/// Takes a pending signal out of `interrupt_descriptor`. Returns false if none is pending, for example because another
/// thread has taken it.
bool take_interrupt();

/// While an object exists, the waits of this file and of the ports in this thread call `over` of the newest object
/// after each 20 ms without an event and throw Ended if it returns true: for conditions that no descriptor reports,
/// such as a signal handled by an interpreter, or another thread.
class CancelCheck {
 public:
  /// `over` must outlive the object; an empty function is never called.
  explicit CancelCheck(const std::function<bool()>& over);
  ~CancelCheck();
  CancelCheck(const CancelCheck&) = delete;
  CancelCheck& operator=(const CancelCheck&) = delete;

  /// Returns how long a wait may take before it must call `check`; `never` if no CancelCheck exists in this thread, or
  /// the newest one has an empty function.
  [[nodiscard]] static Time interval();
  /// Calls `over` of the newest CancelCheck of this thread. Throws Ended if it returns true.
  static void check();

 private:
  const std::function<bool()>* outer_;
};

/// Returns the time of CLOCK_MONOTONIC.
[[nodiscard]] Time now();

inline constexpr std::size_t most_watched = 32;

/// Blocks until one of `watched` (at most `most_watched`) has an event, then sets `revents` of all and returns true;
/// returns false if `deadline` (`never`: no deadline) is reached first. Events that are ready at once are seen even
/// after the deadline. Throws Interrupted once for each signal, or for several that arrived together, so that unwinding
/// code may wait again; throws Ended (CancelCheck) and Failure.
bool wait_for(std::span<pollfd> watched, Time deadline);

/// Sleeps until `time`: may return late by the kernel's timer slack (50 us) and scheduling, never early. Throws as
/// `wait_for` does.
void sleep_until(Time time);

/// Polls the clock for the last 100 us and returns at `time`, late by one read of the clock unless another thread takes
/// the processor; returns at once if `time` is past. Throws as `wait_for` does.
void reach(Time time);

}  // namespace absenc::os
