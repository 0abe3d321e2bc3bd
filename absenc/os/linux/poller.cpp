// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/poller.hpp"

#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

Poller::Poller()
    : epoll_(::epoll_create1(EPOLL_CLOEXEC)), timer_(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)) {
  if (!epoll_ || !timer_) throw system_failure("making a poller", errno);
  add(timer_.get());
}

void Poller::add(int descriptor) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = descriptor;
  if (::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, descriptor, &event) < 0) throw system_failure("epoll_ctl", errno);
}

void Poller::remove(int descriptor) { ::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, descriptor, nullptr); }

void Poller::arm(Time deadline) {
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(deadline);
  // An expiry time of zero would disarm the timer, so 1 ns is set instead.
  itimerspec setting{};
  setting.it_value = {whole.count(), deadline > whole ? (deadline - whole).count() : whole.count() == 0 ? 1 : 0};
  if (::timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &setting, nullptr) < 0) {
    throw system_failure("timerfd_settime", errno);
  }
  armed_ = deadline;
}

std::span<const int> Poller::wait(Time deadline) {
  if (interrupts_ < 0 && interrupt_descriptor() >= 0) add(interrupts_ = interrupt_descriptor());
  // A timer that is set to an earlier time stays so: one useless wake-up costs less than setting the timer at every
  // wait.
  const bool over = deadline < armed_ && now() >= deadline;
  if (!over && deadline < armed_) arm(deadline);
  const Time patience = CancelCheck::interval();
  const int timeout_ms = over ? 0 : patience == never ? -1 : static_cast<int>(patience / std::chrono::milliseconds(1));
  for (;;) {
    std::array<epoll_event, most_ready> events;
    const int count = ::epoll_wait(epoll_.get(), events.data(), most_ready, timeout_ms);
    if (count < 0 && errno != EINTR) throw system_failure("epoll_wait", errno);
    std::size_t ready = 0;
    bool rang = false;
    for (int i = 0; i < count; ++i) {
      const int descriptor = events[static_cast<std::size_t>(i)].data.fd;
      if (descriptor == interrupts_) {
        if (take_interrupt()) throw Interrupted{};
      } else if (descriptor == timer_.get()) {
        rang = true;
      } else {
        ready_[ready++] = descriptor;
      }
    }
    if (rang) {
      std::uint64_t times = 0;
      static_cast<void>(::read(timer_.get(), &times, sizeof times));
      armed_ = never;
    }
    if (ready > 0) return {ready_.data(), ready};
    if (over) return {};
    if (count == 0) CancelCheck::check();
    if (!rang) continue;
    if (now() >= deadline) return {};
    if (deadline != never) arm(deadline);
  }
}

}  // namespace absenc::os
