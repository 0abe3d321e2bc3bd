// SPDX-License-Identifier: Apache-2.0
// Times of equal distance that do not drift: one that was missed is left out.
#pragma once

#include <algorithm>
#include <cstdint>

#include "absenc/core/time.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::tool {

class Pace {
 public:
  /// `rate` a second; 0: as fast as can be. The first time lies `offset` from now.
  explicit Pace(double rate, Time offset = {})
      : period_(rate > 0 ? static_cast<std::int64_t>(1e9 / rate) : 0), next_(os::now() + offset) {}

  /// The next time; with rate 0 the past.
  Time next() {
    if (period_ == Time{}) return {};
    next_ += period_;
    const Time late = os::now() - next_;
    if (late > Time{}) next_ += late / period_ * period_;
    return next_;
  }

  /// Sleeps until the next time, or `end`. Returns how many times before `end` were left out because they were over:
  /// whoever took longer than a period, or was stopped, has missed them. Throws as os::sleep_until.
  std::uint64_t wait(Time end = never) {
    if (period_ == Time{}) return 0;
    next_ += period_;
    const std::uint64_t missed = leave_out(end);
    os::sleep_until(std::min(next_, end));
    return missed + leave_out(end);
  }

  /// The first time, again.
  void start_at(Time start) { next_ = start; }

  [[nodiscard]] Time period() const { return period_; }

 private:
  // One that is over by less than a period is late, and not missed unless the end has come.
  std::uint64_t leave_out(Time end) {
    const Time now = os::now();
    if (now < next_) return 0;
    const Time first = next_;
    const auto over = (now - next_) / period_;
    next_ += over * period_;
    if (now < end) return static_cast<std::uint64_t>(over);
    next_ = std::max(next_, end);
    return first < end ? static_cast<std::uint64_t>((end - first - Time{1}) / period_ + 1) : 0;
  }

  Time period_;
  Time next_;
};

}  // namespace absenc::tool
