// SPDX-License-Identifier: Apache-2.0
// Waits that Ctrl-C and Ctrl-Break end: the control handler, which Windows runs in a thread of its own, sets an event.
#include "absenc/os/signals.hpp"

#include <array>
#include <atomic>
#include <stdexcept>
#include <vector>

#include "absenc/os/error.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/waitable.hpp"

namespace absenc::os {

namespace {

class Interrupts final : public Waitable {
 public:
  HANDLE readable() override { return event_.get(); }
  void raise() {
    pending_ = true;
    ::SetEvent(event_.get());
  }
  bool take() {
    const bool was_pending = pending_.exchange(false);
    if (was_pending) ::ResetEvent(event_.get());
    return was_pending;
  }

 private:
  Handle event_ = make_event();
  std::atomic<bool> pending_{false};
};

std::atomic<Interrupts*> interrupts{nullptr};  // null before `catch_interrupts`
std::atomic<int> descriptor{-1};               // of `interrupts`
std::atomic<bool> received{false};

BOOL WINAPI on_control(DWORD event) {
  received = true;
  interrupts.load()->raise();
  // After a closed window, a log-off or a shutdown Windows ends the process as soon as this function returns, and in
  // any case after some seconds: the time is for the end of what the program does.
  if (event != CTRL_C_EVENT && event != CTRL_BREAK_EVENT) ::Sleep(INFINITE);
  return TRUE;
}

void install() {
  auto object = std::make_unique<Interrupts>();
  interrupts = object.get();
  descriptor = descriptor_of(std::move(object)).release();
  ::SetConsoleCtrlHandler(nullptr, FALSE);  // a parent may have made this process ignore Ctrl-C
  if (::SetConsoleCtrlHandler(&on_control, TRUE) == 0) throw windows_failure("catching Ctrl-C", ::GetLastError());
}

}  // namespace

void catch_interrupts() {
  static const bool once = (install(), true);
  static_cast<void>(once);
}

bool interrupted() { return received; }

int interrupt_descriptor() { return descriptor.load(std::memory_order_relaxed); }

bool take_interrupt() {
  Interrupts* const all = interrupts;
  return all != nullptr && all->take();
}

Time now() {
  static const std::int64_t frequency = [] {
    LARGE_INTEGER ticks_per_second{};
    ::QueryPerformanceFrequency(&ticks_per_second);
    return ticks_per_second.QuadPart;
  }();
  LARGE_INTEGER ticks{};
  ::QueryPerformanceCounter(&ticks);
  const std::int64_t whole = ticks.QuadPart / frequency;
  const std::int64_t rest = ticks.QuadPart % frequency;  // computed apart, because ticks in ns would overflow
  return std::chrono::seconds(whole) + Time(rest * 1'000'000'000 / frequency);
}

bool wait_for(std::span<Watched> watched, Time deadline) {
  if (watched.size() > most_watched) throw std::length_error("too many descriptors to wait for");
  std::vector<HANDLE> events;
  const auto update = [&](bool collects) {
    bool any = false;
    for (Watched& one : watched) {
      if (one.descriptor < 0) continue;
      Waitable* const object = waitable_of(one.descriptor);
      const HANDLE to_read = object == nullptr ? nullptr : object->readable();  // a file is always ready
      const HANDLE to_write = object == nullptr ? nullptr : object->writable();
      one.ready.to_read = to_read == nullptr || is_set(to_read);
      one.ready.to_write = one.wanted.to_write && (to_write == nullptr || is_set(to_write));
      any = any || (one.wanted.to_read && one.ready.to_read) || one.ready.to_write;
      if (!collects) continue;
      if (one.wanted.to_read && to_read != nullptr) events.push_back(to_read);
      if (one.wanted.to_write && to_write != nullptr) events.push_back(to_write);
    }
    return any;
  };
  if (take_interrupt()) throw Interrupted{};
  if (update(true)) return true;
  const bool any = wait_any(events, deadline).has_value();
  update(false);
  return any;
}

}  // namespace absenc::os
