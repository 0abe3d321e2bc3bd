// SPDX-License-Identifier: Apache-2.0
// Times of equal distance that do not drift: one that was missed is skipped.
#pragma once

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

  [[nodiscard]] Time period() const { return period_; }

 private:
  Time period_;
  Time next_;
};

}  // namespace absenc::tool
