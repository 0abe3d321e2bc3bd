// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/delay_watch.hpp"

#include <poll.h>

#include <algorithm>
#include <chrono>

#include "absenc/os/error.hpp"
#include "absenc/os/linux/timespec.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

namespace {

using namespace std::chrono_literals;

constexpr Time wakeup_interval = 1ms;
// Time between two bytes that are sent through a pseudo-terminal. The kernel's worker thread that delivers a byte must
// have slept before, because only then does the byte show how late the thread wakes up.
constexpr Time byte_interval = 5ms;
// More pseudo-terminals see a delay sooner: the kernel's worker threads are late independently of each other.
constexpr std::size_t loop_count = 4;

}  // namespace

DelayWatch::DelayWatch(bool terminals) {
  for (std::size_t i = 0; terminals && i < loop_count; ++i) {
    try {
      loops_.push_back({.terminal = open_terminal_pair()});
    } catch (const Failure&) {
      break;
    }
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
}

void DelayWatch::watch(const std::stop_token& stop) {
  std::vector<pollfd> watched;
  for (const ByteLoop& loop : loops_) watched.push_back({loop.terminal.slave.get(), POLLIN, 0});
  Time due = now() + wakeup_interval;
  while (!stop.stop_requested()) {
    const timespec pause = to_timespec(std::max(due - now(), Time{}));
    ::ppoll(watched.data(), watched.size(), &pause, nullptr);
    for (ByteLoop& loop : loops_) exchange(loop);
    const Time late = now() - due;
    if (late < Time{}) continue;
    note(late);
    due = now() + wakeup_interval;
  }
}

void DelayWatch::exchange(ByteLoop& loop) {
  char byte = 'x';
  const Time time = now();
  if (loop.is_out) {
    note(time - loop.sent_at);
    loop.is_out = ::read(loop.terminal.slave.get(), &byte, 1) != 1;
    loop.due = time + byte_interval;
  } else if (time >= loop.due) {
    loop.sent_at = time;
    loop.is_out = ::write(loop.terminal.master.get(), &byte, 1) == 1;
  }
}

void DelayWatch::note(Time delay) { latest_.store(std::max(latest_.load(), delay.count())); }

}  // namespace absenc::os
