// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/poller.hpp"

#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>

#include "absenc/os/descriptor.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/linux/timespec.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

struct Poller::State {
  State();
  void add(int descriptor) const;
  void arm(Time deadline);
  [[nodiscard]] std::span<const int> wait(Time deadline);

  Descriptor epoll;
  Descriptor timer;
  Time armed = never;   // time at which `timer` expires; `never` if it is not set
  int interrupts = -1;  // descriptor that is readable after SIGINT or SIGTERM; -1 while these signals are not caught
  std::array<int, most_ready> ready{};
};

Poller::State::State()
    : epoll(::epoll_create1(EPOLL_CLOEXEC)), timer(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)) {
  if (!epoll || !timer) throw system_failure("making a poller", errno);
  add(timer.get());
}

void Poller::State::add(int descriptor) const {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = descriptor;
  if (::epoll_ctl(epoll.get(), EPOLL_CTL_ADD, descriptor, &event) < 0) throw system_failure("epoll_ctl", errno);
}

void Poller::State::arm(Time deadline) {
  itimerspec setting{};
  setting.it_value = to_timespec(std::max(deadline, Time(1)));  // an expiry time of zero would disarm the timer
  if (::timerfd_settime(timer.get(), TFD_TIMER_ABSTIME, &setting, nullptr) < 0) {
    throw system_failure("timerfd_settime", errno);
  }
  armed = deadline;
}

std::span<const int> Poller::State::wait(Time deadline) {
  if (interrupts < 0 && interrupt_descriptor() >= 0) add(interrupts = interrupt_descriptor());
  // A timer that is set to an earlier time stays so: one useless wake-up costs less than setting the timer at every
  // wait.
  const bool over = deadline < armed && now() >= deadline;
  if (!over && deadline < armed) arm(deadline);
  const Time patience = CancelCheck::interval();
  const int timeout_ms = over ? 0 : patience == never ? -1 : static_cast<int>(patience / std::chrono::milliseconds(1));
  for (;;) {
    std::array<epoll_event, most_ready> events;
    const int count = ::epoll_wait(epoll.get(), events.data(), most_ready, timeout_ms);
    if (count < 0 && errno != EINTR) throw system_failure("epoll_wait", errno);
    std::size_t count_ready = 0;
    bool rang = false;
    for (int i = 0; i < count; ++i) {
      const int descriptor = events[static_cast<std::size_t>(i)].data.fd;
      if (descriptor == interrupts) {
        if (take_interrupt()) throw Interrupted{};
      } else if (descriptor == timer.get()) {
        rang = true;
      } else {
        ready[count_ready++] = descriptor;
      }
    }
    if (rang) {
      std::uint64_t times = 0;
      static_cast<void>(::read(timer.get(), &times, sizeof times));
      armed = never;
    }
    if (count_ready > 0) return {ready.data(), count_ready};
    if (over) return {};
    if (count == 0) CancelCheck::check();
    if (!rang) continue;
    if (now() >= deadline) return {};
    if (deadline != never) arm(deadline);
  }
}

Poller::Poller() : state_(std::make_unique<State>()) {}

Poller::~Poller() = default;

void Poller::add(int descriptor) { state_->add(descriptor); }

void Poller::remove(int descriptor) { ::epoll_ctl(state_->epoll.get(), EPOLL_CTL_DEL, descriptor, nullptr); }

std::span<const int> Poller::wait(Time deadline) { return state_->wait(deadline); }

}  // namespace absenc::os
