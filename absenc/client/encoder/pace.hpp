// SPDX-License-Identifier: Apache-2.0
// Equally spaced times that do not drift.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "absenc/core/time.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

class Pace {
 public:
  /// Takes the rate in Hz (0: as fast as possible) and the time from now to the first due time.
  explicit Pace(double rate, Time offset = {})
      : period_(rate > 0 ? static_cast<std::int64_t>(1e9 / rate) : 0), next_(os::now() + offset) {}

  /// Returns the next due time; the first call returns the second due time of the series. Without a rate it returns a
  /// time in the past.
  Time next() {
    if (period_ == Time{}) return {};
    next_ += period_;
    const Time late = os::now() - next_;
    if (late > Time{}) next_ += late / period_ * period_;
    return next_;
  }

  /// Sleeps until the next due time, or until `end` if that is earlier; returns at once without a rate.
  template <class SleepUntil>
  void wait(Time end, SleepUntil sleep_until) {
    if (period_ == Time{}) return;
    next_ += period_;
    leave_out(end);
    try {
      sleep_until(std::min(next_, end));
    } catch (...) {
      leave_out(end);
      throw;
    }
    leave_out(end);
  }

  void wait() { wait(never, os::sleep_until); }

  /// Skips due times that have passed and counts them as missed. Keeps one that passed less than a period ago, unless
  /// `end` has been reached.
  void leave_out(Time end) {
    const Time now = os::now();
    if (period_ == Time{} || now < next_) return;
    const Time first = next_;
    const auto over = (now - next_) / period_;
    next_ += over * period_;
    if (now < end) {
      missed_ += static_cast<std::uint64_t>(over);
      return;
    }
    next_ = std::max(next_, end);
    if (first < end) missed_ += static_cast<std::uint64_t>((end - first - Time{1}) / period_ + 1);
  }

  [[nodiscard]] std::uint64_t take_missed() { return std::exchange(missed_, 0); }

  /// Begins a new series of due times at `start`; the next call of `next` or `wait` is for the due time after `start`.
  void start_at(Time start) { next_ = start; }

  [[nodiscard]] Time period() const { return period_; }

 private:
  Time period_;
  Time next_;
  std::uint64_t missed_ = 0;
};

}  // namespace absenc::client
