// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/windows/waitable.hpp"

#include <io.h>

#include <array>
#include <cerrno>
#include <map>
#include <mutex>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/standard_input.hpp"

namespace absenc::os {

namespace {

constexpr int first_number = 1 << 16;  // the C library has at most 8192 files

struct Numbers {
  std::mutex mutex;
  std::map<int, std::unique_ptr<Waitable>> objects;
  int next = first_number;
};

// Is never destroyed, because threads may still close descriptors while the program ends.
Numbers& numbers() {
  static auto* const all = new Numbers;
  return *all;
}

/// A timer of the calling thread. Plain timers of Windows are late by up to 16 ms, those of high resolution by less
/// than 1 ms (Windows 10 version 1803 and later).
class Timer {
 public:
  Timer() : timer_(::CreateWaitableTimerExW(nullptr, nullptr, high_resolution, TIMER_ALL_ACCESS)) {
    if (!timer_) timer_ = Handle(::CreateWaitableTimerExW(nullptr, nullptr, 0, TIMER_ALL_ACCESS));
    if (!timer_) throw windows_failure("making a timer", ::GetLastError());
  }
  HANDLE set(Time after) {
    using Ticks = std::chrono::duration<LONGLONG, std::ratio<1, 10'000'000>>;
    LARGE_INTEGER due{};
    due.QuadPart = -std::max<LONGLONG>(1, std::chrono::ceil<Ticks>(after).count());  // negative: from now on
    if (::SetWaitableTimer(timer_.get(), &due, 0, nullptr, nullptr, FALSE) == 0) {
      throw windows_failure("setting a timer", ::GetLastError());
    }
    return timer_.get();
  }

 private:
  static constexpr DWORD high_resolution = 0x2;  // CREATE_WAITABLE_TIMER_HIGH_RESOLUTION
  Handle timer_;
};

}  // namespace

Handle make_event(bool set) {
  Handle event(::CreateEventW(nullptr, TRUE, set ? TRUE : FALSE, nullptr));
  if (!event) throw windows_failure("making an event", ::GetLastError());
  return event;
}

std::ptrdiff_t Waitable::read(MutableBytes) {
  errno = EBADF;
  return -1;
}

std::ptrdiff_t Waitable::write(Bytes) {
  errno = EBADF;
  return -1;
}

Descriptor descriptor_of(std::unique_ptr<Waitable> object) {
  const std::lock_guard lock(numbers().mutex);
  const int number = numbers().next++;
  numbers().objects.emplace(number, std::move(object));
  return Descriptor(number);
}

Waitable* waitable_of(int number) {
  if (number == 0) return &standard_input();
  const std::lock_guard lock(numbers().mutex);
  const auto found = numbers().objects.find(number);
  return found == numbers().objects.end() ? nullptr : found->second.get();
}

void Descriptor::close() {
  if (number_ < 0) return;
  const int number = std::exchange(number_, -1);
  if (number < first_number) {
    ::_close(number);
    return;
  }
  std::unique_ptr<Waitable> object;  // is destroyed after the lock, because that may wait
  const std::lock_guard lock(numbers().mutex);
  if (const auto found = numbers().objects.find(number); found != numbers().objects.end()) {
    object = std::move(found->second);
    numbers().objects.erase(found);
  }
}

std::optional<std::size_t> wait_any(std::span<const HANDLE> events, Time deadline) {
  thread_local Timer timer;
  std::array<HANDLE, MAXIMUM_WAIT_OBJECTS> all{};
  if (events.size() + 2 > all.size()) throw Failure(Failure::Kind::system, "too many descriptors to wait for");
  for (;;) {
    DWORD count = 0;
    Waitable* const interrupts = interrupt_descriptor() < 0 ? nullptr : waitable_of(interrupt_descriptor());
    if (interrupts != nullptr) all[count++] = interrupts->readable();
    const DWORD first = count;
    for (const HANDLE event : events) all[count++] = event;
    const Time time = now();
    const Time patience = CancelCheck::interval();
    const Time until = patience == never ? deadline : std::min(deadline, time + patience);
    const DWORD limit = until <= time ? 0 : INFINITE;
    if (until > time && until != never) all[count++] = timer.set(until - time);
    if (count == 0) {
      ::Sleep(limit);  // nothing can end this wait but its deadline
      return std::nullopt;
    }
    const DWORD result = ::WaitForMultipleObjects(count, all.data(), FALSE, limit);
    if (result == WAIT_FAILED) throw windows_failure("waiting", ::GetLastError());
    const DWORD index = result == WAIT_TIMEOUT ? count : result - WAIT_OBJECT_0;
    if (index < first) {
      if (take_interrupt()) throw Interrupted{};
    } else if (index < first + events.size()) {
      return index - first;
    } else if (now() >= deadline) {
      return std::nullopt;
    } else {
      CancelCheck::check();
    }
  }
}

}  // namespace absenc::os
