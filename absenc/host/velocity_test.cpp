// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/velocity.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>

namespace absenc::host {
namespace {

using namespace std::chrono_literals;

TEST(Velocity, NeedsTwoPositions) {
  Velocity velocity;
  EXPECT_FALSE(velocity.valid());
  velocity.add(100, 1ms);
  EXPECT_FALSE(velocity.valid());
  EXPECT_EQ(velocity.counts_per_second(), 0);
  EXPECT_EQ(velocity.uncertainty(), 0);
  EXPECT_EQ(velocity.delay(), 0ms);
  velocity.add(0, 2ms);
  EXPECT_TRUE(velocity.valid());
  EXPECT_NEAR(velocity.counts_per_second(), -100'000, 1e-6);
  EXPECT_NEAR(velocity.uncertainty(), 1000, 1e-6);
  EXPECT_EQ(velocity.delay(), 500us);
  EXPECT_EQ(velocity.since().earliest, 1ms);
  velocity.restart();
  EXPECT_FALSE(velocity.valid());
}

TEST(Velocity, IsTheMeanOverItsWindow) {
  Velocity velocity(10ms);
  for (int i = 0; i <= 100; ++i) velocity.add(i < 50 ? 0 : (i - 50) * 7, i * 1ms);
  EXPECT_NEAR(velocity.counts_per_second(), 7000, 1e-6);
  EXPECT_GE(velocity.delay(), 5ms);
  EXPECT_LE(velocity.delay(), 7ms);
}

TEST(Velocity, WindowIsAtMostTwoMinutes) {
  Velocity velocity(10min);
  for (int i = 0; i <= 120; ++i) velocity.add(i * 100'000LL, i * 10s);
  EXPECT_GE(velocity.delay(), 60s);
  EXPECT_LE(velocity.delay(), 84s);
}

TEST(Velocity, SpansOneStepIfReadingsAreRare) {
  Velocity velocity(10ms);
  velocity.add(0, 0s);
  velocity.add(5, 1s);
  velocity.add(25, 2s);
  EXPECT_NEAR(velocity.counts_per_second(), 20, 1e-6);
  EXPECT_EQ(velocity.delay(), 500ms);
}

TEST(Velocity, KeepsItsWindowAtAnyRate) {
  for (const Time period : {10us, 100us, 1000us, 7000us}) {
    Velocity velocity;
    for (int i = 0; i < 20'000; ++i) {
      velocity.add(i * 1000LL, i * period);
      if (!velocity.valid() || i * period < 100ms) continue;
      ASSERT_GE(velocity.delay(), 18ms) << period.count();
      ASSERT_LE(velocity.delay(), 40ms) << period.count();
    }
  }
}

TEST(Velocity, IgnoresPositionsThatAreNotLater) {
  Velocity velocity;
  velocity.add(0, 1ms);
  velocity.add(100, 2ms);
  velocity.add(5000, 2ms);
  EXPECT_FALSE(velocity.valid()) << "a position without a speed";
  velocity.add(6000, 1ms);
  EXPECT_FALSE(velocity.valid());
  velocity.add(200, 3ms);
  EXPECT_NEAR(velocity.counts_per_second(), 100'000, 1e-6);
}

TEST(Velocity, IsReportedAtOnceForAStandingShaft) {
  Velocity velocity;
  for (int i = 0; i < 50; ++i) {
    velocity.add(7, i * 1ms);
    ASSERT_FALSE(velocity.valid()) << i << ": one count is a large speed in so short a time";
  }
  velocity.add(7, 50ms);
  ASSERT_TRUE(velocity.valid());
  EXPECT_EQ(velocity.counts_per_second(), 0);
  EXPECT_NEAR(velocity.uncertainty(), 20, 1e-6);
}

TEST(Velocity, WaitsForTwentyCountsUpToTwentyWindows) {
  Velocity velocity(10ms);
  for (int i = 0; i < 200; ++i) {
    velocity.add(i / 50, i * 1ms);  // the shaft moves at 20 counts per second
    if (velocity.valid()) {
      ASSERT_EQ(velocity.counts_per_second(), 0) << i;
    }
  }
  velocity.add(4, 200ms);
  ASSERT_TRUE(velocity.valid());
  EXPECT_NEAR(velocity.counts_per_second(), 20, 1e-6);
  EXPECT_NEAR(velocity.uncertainty(), 5, 1e-6);
}

TEST(Velocity, WaitsUntilWindowExceedsTimeUncertainty) {
  Velocity velocity;
  const auto add = [&](int i, Time width) { velocity.add(i * 1000, {i * 1ms, i * 1ms + width}); };
  for (int i = 0; i < 80; ++i) {
    add(i, 4ms);
    ASSERT_FALSE(velocity.valid()) << i;
  }
  add(80, 4ms);
  ASSERT_TRUE(velocity.valid());
  EXPECT_NEAR(velocity.counts_per_second(), 1e6, 5e3);
  EXPECT_LE(velocity.uncertainty(), 0.06e6);
  EXPECT_GE(velocity.uncertainty(), 0.05e6);
  add(81, 20ms);
  EXPECT_FALSE(velocity.valid()) << "nobody knows when the last was latched";
}

TEST(Velocity, IsInvalidIfLongestWindowIsTooUncertain) {
  Velocity good;
  Velocity bad;
  for (int i = 0; i <= 1100; ++i) {
    good.add(i * 1000, {i * 1ms, i * 1ms + 240ms});
    bad.add(i * 1000, {i * 1ms, i * 1ms + 280ms});
    EXPECT_FALSE(bad.valid());
  }
  ASSERT_TRUE(good.valid());
  EXPECT_LE(good.uncertainty(), 0.26e6);
}

TEST(Velocity, SpeedIsInCountsPer1000Seconds) {
  Velocity velocity;
  EXPECT_EQ(velocity.speed().speed, 0);
  EXPECT_EQ(velocity.speed().uncertainty, 0);
  velocity.add(100, 1ms);
  velocity.add(0, 2ms);
  EXPECT_EQ(velocity.speed().speed, -100'000'000);
  EXPECT_EQ(velocity.speed().uncertainty, 1'000'000);
  velocity.restart();
  velocity.add(100, 0s);
  velocity.add(107, 3s);
  EXPECT_EQ(velocity.speed().speed, 2333) << "8 counts in 3 s are rounded up, 6 counts down, so 2333.5 is the middle";
  EXPECT_EQ(velocity.speed().uncertainty, 334);
}

// The speed is computed at compile time, where the compiler refuses an overflow.
constexpr MilliSpeed speed_between(std::int64_t from, std::int64_t to, Time pause) {
  Velocity velocity(1ns);
  velocity.add(from, Time{});
  velocity.add(to, pause);
  return velocity.speed();
}

TEST(Velocity, SaturatesAtExtremes) {
  constexpr std::int64_t least = std::numeric_limits<std::int64_t>::min();
  static constexpr Time years{std::int64_t{1} << 58};
  constexpr MilliSpeed fast = speed_between(0, MilliSpeed::most, 1ns);
  EXPECT_EQ(fast.speed, MilliSpeed::most);
  EXPECT_EQ(fast.uncertainty, MilliSpeed::most);
  constexpr MilliSpeed backwards = speed_between(0, least, 1ns);
  EXPECT_EQ(backwards.speed, -MilliSpeed::most);
  EXPECT_EQ(backwards.uncertainty, MilliSpeed::most);
  constexpr MilliSpeed around = speed_between(MilliSpeed::most, least, 1s);
  EXPECT_EQ(around.speed, 1000) << "a position that wraps moves by one count";
  constexpr MilliSpeed standing = speed_between(5, 5, years);
  EXPECT_EQ(standing.speed, 0);
  EXPECT_EQ(standing.uncertainty, 1) << "one count in 9 years, rounded up";
  constexpr MilliSpeed long_way = speed_between(0, MilliSpeed::most, years);
  EXPECT_NEAR(static_cast<double>(long_way.speed), 32e12, 32e12 * 0x1p-29);
  constexpr Velocity late = [] {
    constexpr Time start{-(std::int64_t{1} << 62)};
    Velocity velocity(Time::max());
    for (int i = 0; i <= 100; ++i) velocity.add(i, {start, start + (years / 100) * i});
    return velocity;
  }();
  EXPECT_FALSE(late.valid());
}

// Position of a shaft in counts as a function of seconds.
using Motion = std::function<double(double)>;

// Compares each speed with the true mean speed over its window.
void expect_bounds(const Motion& motion, Time period, Time longest_jitter, unsigned seed, std::size_t least_valid) {
  std::mt19937_64 random(seed);
  const auto within = [&](Time most) {
    return Time(std::uniform_int_distribution<Time::rep>(0, most.count())(random));
  };
  Velocity velocity;
  std::map<Time, Time> truths;  // key: earliest latch time of a position; value: its true latch time
  const auto place = [&](Time at) { return motion(std::chrono::duration<double>(at).count()); };
  std::size_t valid = 0;
  for (int i = 0; i < 3000; ++i) {
    const Time truth = i * period + within(period / 2);
    const bool is_late = random() % 4 == 0;
    const LatchTime at{truth - within(is_late ? longest_jitter : longest_jitter / 50),
                       truth + within(is_late ? longest_jitter : longest_jitter / 50)};
    truths[at.earliest] = truth;
    velocity.add(static_cast<std::int64_t>(std::floor(place(truth))), at);
    if (!velocity.valid()) continue;
    ++valid;
    const Time since = truths.at(velocity.since().earliest);
    const double mean = (place(truth) - place(since)) * 1e9 / static_cast<double>((truth - since).count());
    ASSERT_LE(std::abs(velocity.counts_per_second() - mean), velocity.uncertainty() * (1 + 1e-9) + 1e-6)
        << "reading " << i << ", seed " << seed;
  }
  EXPECT_GE(valid, least_valid);
}

TEST(Velocity, ErrorIsWithinItsUncertainty) {
  constexpr double turn = 131'072;
  const auto steady = [](double rpm) { return [=](double seconds) { return rpm / 60 * turn * seconds; }; };
  const auto sine = [](double hertz) {
    return [=](double seconds) { return 5 * turn * std::sin(2 * M_PI * hertz * seconds); };
  };
  for (unsigned seed = 1; seed <= 5; ++seed) {
    for (const double rpm : {0.0, 0.01, 1.0, -12.0, 60.0, -3000.0, 60'000.0}) {
      for (const Time jitter : {0us, 60us, 500us, 9'000us, 60'000us}) {
        SCOPED_TRACE(rpm);
        for (const Time period : {100us, 1'000us, 20'000us, 300'000us}) {
          expect_bounds(steady(rpm), period, jitter, seed,
                        jitter <= 500us && period >= 1ms && std::abs(rpm) != 0.01 ? 1000 : 0);
        }
      }
    }
    for (const double hertz : {0.1, 1.0, 10.0, 100.0}) {
      SCOPED_TRACE(hertz);
      for (const Time jitter : {0us, 60us, 500us, 9'000us}) {
        expect_bounds(sine(hertz), 1'000us, jitter, seed, 0);
        expect_bounds(sine(hertz), 100us, jitter, seed, 0);
      }
    }
  }
}

}  // namespace
}  // namespace absenc::host
