// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/signals.hpp"

#include <utility>

#include "absenc/os/error.hpp"

namespace absenc::os {

namespace {
thread_local const std::function<bool()>* is_over = nullptr;
}  // namespace

CancelCheck::CancelCheck(const std::function<bool()>& over) : outer_(std::exchange(is_over, over ? &over : nullptr)) {}

CancelCheck::~CancelCheck() { is_over = outer_; }

Time CancelCheck::interval() { return is_over == nullptr ? never : std::chrono::milliseconds(20); }

void CancelCheck::check() {
  if (is_over != nullptr && (*is_over)()) throw Ended{};
}

void sleep_until(Time time) {
  while (now() < time) wait_for({}, time);
}

void reach(Time time) {
  // The kernel may wake a sleeping thread too late by about this time, so the thread sleeps less by it and then polls
  // the clock.
  constexpr Time wake_up = std::chrono::microseconds(100);
  if (time - now() > wake_up) sleep_until(time - wake_up);
  while (now() < time) {
  }
}

}  // namespace absenc::os
