// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/stamp_clock.hpp"

#include <ctime>

#include "absenc/os/signals.hpp"

namespace absenc::os {

ClockPair read_clocks() {
  constexpr int most_attempts = 8;
  constexpr Time quick = std::chrono::microseconds(1);
  ClockPair best{};
  for (int attempt = 0; attempt < most_attempts; ++attempt) {
    timespec calendar{};
    ClockPair pair{};
    pair.before = now();
    ::clock_gettime(CLOCK_REALTIME, &calendar);
    pair.after = now();
    pair.calendar = std::chrono::seconds(calendar.tv_sec) + Time(calendar.tv_nsec);
    if (attempt == 0 || pair.after - pair.before < best.after - best.before) best = pair;
    if (best.after - best.before < quick) break;
  }
  return best;
}

}  // namespace absenc::os
