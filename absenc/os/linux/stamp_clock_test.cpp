// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/stamp_clock.hpp"

#include <gtest/gtest.h>

#include "absenc/os/signals.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;

constexpr Time lead = 500'000h;

// Returns a ClockPair whose reading began at `at` and took `width`, while the calendar clock was ahead of os::now by
// `ahead`.
ClockPair clocks(Time at, Time ahead = lead, Time width = 200ns) { return {at, at + ahead + width / 2, at + width}; }

TEST(StampClock, TimeIsExactToWidthOfBothLooks) {
  const StampClock stamps(clocks(1s));
  const StampedTime time = stamps.convert(1500ms + lead, clocks(2s), clocks(2s + 10us));
  EXPECT_GE(time.at, 1500ms);
  EXPECT_LE(time.at - time.late, 1500ms);
  EXPECT_LE(time.late, 200ns);
}

TEST(StampClock, UncertaintyGrowsIfThreadPausedBetweenClocks) {
  const StampClock stamps(clocks(1s, lead, 3ms));
  const StampedTime time = stamps.convert(1500ms + lead, clocks(2s), clocks(2s + 10us));
  EXPECT_GE(time.at, 1500ms);
  EXPECT_LE(time.at - time.late, 1500ms);
  EXPECT_LE(time.late, 3ms);
}

TEST(StampClock, TimeHoldsWhereverClockWasSet) {
  for (const Time step : {Time(-1h), Time(-1s), Time(-1us), Time(-50ns), Time(50ns), Time(1us), Time(1s), Time(1h)}) {
    for (const bool set_before_stamp : {false, true}) {
      const StampClock stamps(clocks(1s));
      const Time stamp = 1500ms + lead + (set_before_stamp ? step : Time{});
      const StampedTime time = stamps.convert(stamp, clocks(2s, lead + step), clocks(2s + 10us, lead + step));
      EXPECT_GE(time.at, 1500ms) << step.count();
      EXPECT_LE(time.at - time.late, 1500ms) << step.count();
      EXPECT_LE(time.at, 2s + 10us) << step.count();
    }
  }
}

TEST(StampClock, StampOfReadIsNotTakenForArrival) {
  const StampClock stamps(clocks(1s));
  const StampedTime time = stamps.convert(2s + 5us + lead, clocks(2s), clocks(2s + 10us));
  EXPECT_EQ(time.at, 2s + 10us);
  EXPECT_EQ(time.late, 1s + 10us);
}

TEST(StampClock, StampFromBeforeEmptyQueueIsNotBelieved) {
  const StampClock stamps(clocks(1s));
  EXPECT_EQ(stamps.convert(500ms + lead, clocks(2s), clocks(2s + 10us)).late, 1s + 10us);
}

TEST(StampClock, NewLookAtEmptyQueueNarrowsUncertainty) {
  StampClock stamps(clocks(1s));
  stamps.found_empty(clocks(1900ms, lead + 1h));
  EXPECT_EQ(stamps.convert(std::nullopt, clocks(2s, lead + 1h), clocks(2s + 10us, lead + 1h)).late, 100ms + 10us);
}

TEST(StampClock, ReadClocksEncloseCalendarTime) {
  const Time before = now();
  const ClockPair first = read_clocks();
  const ClockPair second = read_clocks();
  EXPECT_LE(before, first.before);
  EXPECT_LE(first.before, first.after);
  EXPECT_LE(first.after, second.before);
  EXPECT_GT(first.calendar, std::chrono::hours(24 * 365 * 50));
}

}  // namespace
}  // namespace absenc::os
