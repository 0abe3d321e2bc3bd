// SPDX-License-Identifier: Apache-2.0
// The clock of all ports, and waiting that Ctrl-C ends.
#pragma once

#include <poll.h>

#include <cstddef>
#include <functional>
#include <span>

#include "absenc/core/time.hpp"

namespace absenc::os {

/// Makes SIGINT and SIGTERM end the waits below, also where the parent had them ignored (as a shell does for what it
/// puts in the background). Call it early in main; further calls change nothing. Throws Failure.
void catch_interrupts();

/// Whether such a signal has come since `catch_interrupts`, for loops that never wait.
[[nodiscard]] bool interrupted();

/// Readable when such a signal has come; -1 before `catch_interrupts`.
[[nodiscard]] int interrupt_descriptor();
/// Takes the signal out of it; false when another thread was faster.
bool take_interrupt();

/// While one lives, every wait of this thread that takes longer asks `over` each 20 ms, and where it is true ends with
/// Ended: for what no descriptor tells, such as a signal that somebody else handles (an interpreter), or another
/// thread.
class EndQuestion {
 public:
  /// `over` must outlive it; empty: nothing is asked.
  explicit EndQuestion(const std::function<bool()>& over);
  ~EndQuestion();
  EndQuestion(const EndQuestion&) = delete;
  EndQuestion& operator=(const EndQuestion&) = delete;

  /// How long a wait may take until it calls `ask`; `never`: nobody asks.
  [[nodiscard]] static Time patience();
  /// Throws Ended.
  static void ask();

 private:
  const std::function<bool()>* outer_;
};

/// CLOCK_MONOTONIC.
[[nodiscard]] Time now();

inline constexpr std::size_t most_watched = 32;

/// Blocks until one of `watched` (at most `most_watched`) has an event, then sets `revents` of all and returns true;
/// false when `deadline` came first (`never`: no deadline). What is ready at once is seen even after the deadline.
/// Throws Interrupted once for each signal, or for several that came together, so that unwinding may wait again;
/// throws Ended (EndQuestion) and Failure.
bool wait_for(std::span<pollfd> watched, Time deadline);

/// Throws as `wait_for` does. Late by the kernel's timer slack (50 us) and scheduling, never early.
void sleep_until(Time time);

/// Returns in the moment itself, give or take a look at the clock: the last 100 us are spent looking. Throws as
/// `wait_for` does.
void reach(Time time);

}  // namespace absenc::os
