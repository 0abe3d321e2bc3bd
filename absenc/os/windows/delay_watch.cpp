// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/delay_watch.hpp"

#include <algorithm>

#include "absenc/os/signals.hpp"
#include "absenc/os/windows/waitable.hpp"

namespace absenc::os {

// Windows has no pseudo-terminals that could be late.
DelayWatch::DelayWatch(bool) : thread_([this](const std::stop_token& stop) { watch(stop); }) {}

void DelayWatch::watch(const std::stop_token& stop) {
  constexpr Time wakeup_interval = std::chrono::milliseconds(1);
  const Handle nothing = make_event();
  const HANDLE event = nothing.get();
  while (!stop.stop_requested()) {
    const Time due = now() + wakeup_interval;
    static_cast<void>(wait_any({&event, 1}, due));
    note(now() - due);
  }
}

void DelayWatch::note(Time delay) { latest_.store(std::max(latest_.load(), delay.count())); }

}  // namespace absenc::os
