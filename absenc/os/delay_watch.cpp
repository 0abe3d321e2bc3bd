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
constexpr std::size_t terminal_count = 4;

}  // namespace

DelayWatch::DelayWatch(bool terminals) {
  for (std::size_t i = 0; terminals && i < terminal_count; ++i) {
    if (Terminal terminal = open_terminal(); terminal.to) terminals_.push_back(std::move(terminal));
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
}

// Returns a terminal without descriptors if none can be opened.
DelayWatch::Terminal DelayWatch::open_terminal() {
  Terminal terminal{.from = Descriptor(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC))};
  std::array<char, 64> name{};
  termios settings{};
  if (!terminal.from || ::grantpt(terminal.from.get()) != 0 || ::unlockpt(terminal.from.get()) != 0 ||
      ::ptsname_r(terminal.from.get(), name.data(), name.size()) != 0)
    return {};
  terminal.to = Descriptor(::open(name.data(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!terminal.to || ::tcgetattr(terminal.to.get(), &settings) != 0) return {};
  ::cfmakeraw(&settings);
  return ::tcsetattr(terminal.to.get(), TCSANOW, &settings) == 0 ? std::move(terminal) : Terminal{};
}

void DelayWatch::watch(const std::stop_token& stop) {
  std::vector<pollfd> watched;
  for (const Terminal& terminal : terminals_) watched.push_back({terminal.to.get(), POLLIN, 0});
  Time due = now() + wakeup_interval;
  while (!stop.stop_requested()) {
    const timespec pause{0, std::max(due - now(), Time{}).count()};
    ::ppoll(watched.data(), watched.size(), &pause, nullptr);
    for (Terminal& terminal : terminals_) exchange(terminal);
    const Time late = now() - due;
    if (late < Time{}) continue;
    note(late);
    due = now() + wakeup_interval;
  }
}

// Receives the byte that is on its way, or sends the next one if it is due.
void DelayWatch::exchange(Terminal& terminal) {
  char byte = 'x';
  if (terminal.is_out) {
    note(now() - terminal.sent_at);
    if (::read(terminal.to.get(), &byte, 1) != 1) return;
    terminal = {std::move(terminal.from), std::move(terminal.to), now() + byte_interval, false};
  } else if (now() >= terminal.sent_at) {
    terminal.sent_at = now();
    terminal.is_out = ::write(terminal.from.get(), &byte, 1) == 1;
  }
}

void DelayWatch::note(Time delay) { latest_.store(std::max(latest_.load(), delay.count())); }

}  // namespace absenc::os
