// SPDX-License-Identifier: Apache-2.0
// Waits that SIGINT and SIGTERM end: the signal handler makes an eventfd readable, which `wait_for` and Poller watch.
#include "absenc/os/signals.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <ctime>
#include <stdexcept>
#include <utility>

#include "absenc/os/error.hpp"
#include "absenc/os/linux/timespec.hpp"

namespace absenc::os {

namespace {

// A signal handler may use only lock-free variables.
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);
std::atomic<int> wake{-1};  // eventfd that SIGINT and SIGTERM make readable; -1 before `catch_interrupts`
std::atomic<bool> signal_received{false};

void on_signal(int) {
  const int saved = errno;
  signal_received = true;
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(wake, &one, sizeof one);
  errno = saved;
}

void install() {
  wake = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (wake < 0) throw system_failure("eventfd", errno);
  struct sigaction action {};
  action.sa_handler = on_signal;
  // Without SA_RESTART the signal also ends a prompt that reads the terminal.
  for (const int signal : {SIGINT, SIGTERM}) {
    if (::sigaction(signal, &action, nullptr) < 0) throw system_failure("sigaction", errno);
  }
}

timespec time_left(Time deadline) { return to_timespec(std::max(deadline - now(), Time{})); }

}  // namespace

void catch_interrupts() {
  static const bool once = (install(), true);
  static_cast<void>(once);
}

bool interrupted() { return signal_received; }

int interrupt_descriptor() { return wake.load(std::memory_order_relaxed); }

bool take_interrupt() {
  std::uint64_t count = 0;
  return ::read(wake, &count, sizeof count) > 0;
}

Time now() {
  timespec time{};
  ::clock_gettime(CLOCK_MONOTONIC, &time);
  return std::chrono::seconds(time.tv_sec) + Time(time.tv_nsec);
}

bool wait_for(std::span<Watched> watched, Time deadline) {
  if (watched.size() > most_watched) throw std::length_error("too many descriptors to wait for");
  std::array<pollfd, most_watched + 1> all{};
  std::transform(watched.begin(), watched.end(), all.begin(), [](const Watched& one) {
    return pollfd{one.descriptor,
                  static_cast<short>((one.wanted.to_read ? POLLIN : 0) | (one.wanted.to_write ? POLLOUT : 0)), 0};
  });
  pollfd& signal = all[watched.size()];
  signal = {interrupt_descriptor(), POLLIN, 0};  // before `catch_interrupts` the descriptor is -1, which poll ignores
  for (;;) {
    const Time patience = CancelCheck::interval();
    const Time poll_deadline = patience == never ? deadline : std::min(deadline, now() + patience);
    timespec timeout{};
    if (poll_deadline != never) timeout = time_left(poll_deadline);
    const int ready = ::ppoll(all.data(), watched.size() + 1, poll_deadline == never ? nullptr : &timeout, nullptr);
    if (ready < 0) {
      // The wait continues after EINTR: SIGINT and SIGTERM have made the eventfd readable, and other signals do not
      // end a wait.
      if (errno == EINTR) continue;
      throw system_failure("ppoll", errno);
    }
    if (signal.revents != 0) {
      if (take_interrupt()) throw Interrupted{};
      continue;
    }
    if (ready == 0 && poll_deadline < deadline) {
      CancelCheck::check();
      continue;
    }
    for (std::size_t i = 0; i < watched.size(); ++i) {
      watched[i].ready = {(all[i].revents & (POLLIN | POLLERR | POLLHUP | POLLNVAL)) != 0,
                          (all[i].revents & POLLOUT) != 0};
    }
    return ready > 0;
  }
}

}  // namespace absenc::os
