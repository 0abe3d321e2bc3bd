// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/delay_watch.hpp"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "absenc/os/signals.hpp"

namespace absenc::os {

namespace {

using namespace std::chrono_literals;

constexpr Time wakeup_interval = 1ms;
// Time between two bytes through one terminal: the kernel's worker threads must have slept before each of them.
constexpr Time byte_interval = 5ms;
// More terminals see a delay sooner, because the worker threads are late independently of each other.
constexpr std::size_t loop_count = 4;

}  // namespace

DelayWatch::DelayWatch(bool terminals) {
  for (std::size_t i = 0; terminals && i < loop_count; ++i) {
    if (ByteLoop loop = open_loop(); loop.to) loops_.push_back(std::move(loop));
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
}

// Returns a terminal without descriptors if none can be opened.
DelayWatch::ByteLoop DelayWatch::open_loop() {
  ByteLoop loop{.from = Descriptor(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC))};
  std::array<char, 64> name{};
  termios settings{};
  if (!loop.from || ::grantpt(loop.from.get()) != 0 || ::unlockpt(loop.from.get()) != 0 ||
      ::ptsname_r(loop.from.get(), name.data(), name.size()) != 0)
    return {};
  loop.to = Descriptor(::open(name.data(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!loop.to || ::tcgetattr(loop.to.get(), &settings) != 0) return {};
  ::cfmakeraw(&settings);
  return ::tcsetattr(loop.to.get(), TCSANOW, &settings) == 0 ? std::move(loop) : ByteLoop{};
}

void DelayWatch::watch(const std::stop_token& stop) {
  std::vector<pollfd> watched;
  for (const ByteLoop& loop : loops_) watched.push_back({loop.to.get(), POLLIN, 0});
  Time due = now() + wakeup_interval;
  while (!stop.stop_requested()) {
    const timespec pause{0, std::max(due - now(), Time{}).count()};
    ::ppoll(watched.data(), watched.size(), &pause, nullptr);
    for (ByteLoop& loop : loops_) exchange(loop);
    const Time late = now() - due;
    if (late < Time{}) continue;
    note(late);
    due = now() + wakeup_interval;
  }
}

// Receives the byte that is on its way, or sends the next one if it is due.
void DelayWatch::exchange(ByteLoop& loop) {
  char byte = 'x';
  if (loop.is_out) {
    note(now() - loop.sent_at);
    if (::read(loop.to.get(), &byte, 1) != 1) return;
    loop = {std::move(loop.from), std::move(loop.to), now() + byte_interval, false};
  } else if (now() >= loop.sent_at) {
    loop.sent_at = now();
    loop.is_out = ::write(loop.from.get(), &byte, 1) == 1;
  }
}

void DelayWatch::note(Time delay) { latest_.store(std::max(latest_.load(), delay.count())); }

}  // namespace absenc::os
