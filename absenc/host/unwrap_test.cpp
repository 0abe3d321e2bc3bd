// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/unwrap.hpp"

#include <gtest/gtest.h>

namespace absenc::host {
namespace {

using Joined = Unwrapper::Joined;
using namespace std::chrono_literals;

constexpr Reading singleturn(std::uint64_t counts, Time at, unsigned bits = 10) {
  return {.singleturn = counts, .singleturn_bits = bits, .singleturn_valid_bits = bits, .latched = at};
}

Reading multiturn(std::uint64_t turns, std::uint64_t counts, Time at) {
  Reading reading = singleturn(counts, at);
  reading.multiturn = turns;
  reading.multiturn_bits = 4;
  reading.multiturn_valid = true;
  return reading;
}

TEST(Unwrapper, ContinuesAcrossEndOfTurn) {
  Unwrapper unwrapper;
  EXPECT_EQ(unwrapper.add(singleturn(1020, 0ms)), Joined::started);
  EXPECT_EQ(unwrapper.position(), 1020);
  EXPECT_EQ(unwrapper.add(singleturn(4, 1ms)), Joined::continued);
  EXPECT_EQ(unwrapper.position(), 1028);
  EXPECT_EQ(unwrapper.add(singleturn(1020, 2ms)), Joined::continued);
  EXPECT_EQ(unwrapper.add(singleturn(600, 3ms)), Joined::continued);
  EXPECT_EQ(unwrapper.add(singleturn(100, 4ms)), Joined::continued);
  EXPECT_EQ(unwrapper.add(singleturn(1000, 5ms)), Joined::continued);
  EXPECT_EQ(unwrapper.position(), -24);
}

TEST(Unwrapper, ContinuesAcrossEndOfTurnCounter) {
  Unwrapper unwrapper;
  unwrapper.add(multiturn(15, 1000, 0ms));
  EXPECT_EQ(unwrapper.position(), 15 * 1024 + 1000);
  unwrapper.add(multiturn(2, 8, 1ms));
  EXPECT_EQ(unwrapper.position(), 18 * 1024 + 8);
  unwrapper.add(multiturn(15, 1023, 2ms));
  EXPECT_EQ(unwrapper.position(), 15 * 1024 + 1023);
}

TEST(Unwrapper, ContinuesThroughZeroOfSignedTurns) {
  const auto signed_turns = [](std::int64_t turns, std::uint64_t counts, Time at) {
    Reading reading = multiturn(static_cast<std::uint64_t>(turns) & 15, counts, at);
    reading.multiturn_signed = true;
    return reading;
  };
  Unwrapper unwrapper;
  unwrapper.add(signed_turns(-3, 1000, 0ms));
  EXPECT_EQ(unwrapper.position(), -3 * 1024 + 1000);
  unwrapper.add(signed_turns(1, 8, 1ms));
  EXPECT_EQ(unwrapper.position(), 1 * 1024 + 8);
  unwrapper.add(signed_turns(-1, 1023, 2ms));
  EXPECT_EQ(unwrapper.position(), -1);
  // The shaft passes the negative end of the turn counter, where -8 turns are followed by 7.
  unwrapper.add(signed_turns(-7, 0, 3ms));
  unwrapper.add(signed_turns(7, 0, 4ms));
  EXPECT_EQ(unwrapper.position(), -9 * 1024);
}

TEST(Unwrapper, UsesTurnAloneIfTurnsAreInvalid) {
  Unwrapper unwrapper;
  unwrapper.add(multiturn(5, 1000, 0ms));
  Reading lost = multiturn(0, 8, 1ms);
  lost.multiturn_valid = false;
  EXPECT_EQ(unwrapper.add(lost), Joined::continued);
  EXPECT_EQ(unwrapper.position(), 6 * 1024 + 8);
  // The turns are valid again, but differ from the last ones by more than any motion explains.
  EXPECT_EQ(unwrapper.add(multiturn(0, 20, 2ms)), Joined::continued);
  EXPECT_EQ(unwrapper.position(), 6 * 1024 + 20);
}

TEST(Unwrapper, IgnoresInvalidReadings) {
  Unwrapper unwrapper;
  Reading starting = singleturn(7, 0ms);
  starting.ready = false;
  EXPECT_EQ(unwrapper.add(starting), Joined::ignored);
  unwrapper.add(singleturn(100, 1ms));
  Reading coarse = singleturn(900, 2ms);
  coarse.singleturn_valid_bits = 5;
  EXPECT_EQ(unwrapper.add(coarse), Joined::ignored);
  EXPECT_EQ(unwrapper.add(singleturn(110, 3ms)), Joined::continued);
  EXPECT_EQ(unwrapper.position(), 110);
}

TEST(Unwrapper, RestartsAfterTooLongAPause) {
  Unwrapper unwrapper(SpeedLimit{.rpm = 6000});  // at 6000 rpm half a turn takes 5 ms
  unwrapper.add(singleturn(1000, 0ms));
  EXPECT_EQ(unwrapper.add(singleturn(10, 4ms)), Joined::continued);
  EXPECT_EQ(unwrapper.position(), 1034);
  EXPECT_EQ(unwrapper.add(singleturn(20, 9ms)), Joined::restarted);
  EXPECT_EQ(unwrapper.position(), 20);
  EXPECT_EQ(unwrapper.add(singleturn(30, 10ms)), Joined::continued);
}

TEST(Unwrapper, HasADefaultLimit) {
  Unwrapper unwrapper;
  unwrapper.add(singleturn(1000, 0ms));
  EXPECT_EQ(unwrapper.add(singleturn(10, 1ms)), Joined::continued);
  EXPECT_EQ(unwrapper.add(singleturn(1000, 101ms)), Joined::restarted);
}

TEST(Unwrapper, UsesTurnsThatTheReadingsHave) {
  // at 600 rpm the shaft needs 800 ms for half the range of the turn counter (8 turns), and 50 ms for half a turn
  Unwrapper unwrapper(SpeedLimit{.rpm = 600});
  unwrapper.add(multiturn(3, 0, 0ms));
  EXPECT_EQ(unwrapper.add(multiturn(9, 0, 700ms)), Joined::continued);
  EXPECT_EQ(unwrapper.add(multiturn(1, 0, 1500ms)), Joined::restarted);
  Reading without = singleturn(5, 1600ms);
  EXPECT_EQ(unwrapper.add(without), Joined::restarted);
  without.latched = 1640ms;
  EXPECT_EQ(unwrapper.add(without), Joined::continued);
}

TEST(Unwrapper, UsesSpeedOfLinearEncoder) {
  Unwrapper unwrapper;
  Reading reading = singleturn(1000, 0ms);
  reading.unit_um = 1000;  // 1024 counts of 1000 um each are a range of 1.024 m
  unwrapper.add(reading);
  reading.singleturn = 10;
  reading.latched = 20ms;
  EXPECT_EQ(unwrapper.add(reading), Joined::continued);
  reading.latched = 50ms;
  EXPECT_EQ(unwrapper.add(reading), Joined::restarted);
  EXPECT_EQ(unwrapper.position(), 10);
}

TEST(Unwrapper, ReadingsThatArriveTogetherMayBeFarApart) {
  // At 600 rpm half a turn takes 50 ms. The host was delayed for 100 ms.
  Unwrapper unwrapper(SpeedLimit{.rpm = 600}, Times::arrived);
  unwrapper.add(singleturn(0, 0ms));
  EXPECT_EQ(unwrapper.add(singleturn(10, 25ms)), Joined::continued);
  EXPECT_EQ(unwrapper.add(singleturn(20, 125ms)), Joined::restarted);
  EXPECT_EQ(unwrapper.add(singleturn(30, 125ms)), Joined::restarted);
  EXPECT_EQ(unwrapper.add(singleturn(40, 126ms)), Joined::restarted);
  EXPECT_EQ(unwrapper.add(singleturn(50, 150ms)), Joined::restarted);
  for (const Time at : {175ms, 200ms}) EXPECT_EQ(unwrapper.add(singleturn(60, at)), Joined::restarted);
  EXPECT_EQ(unwrapper.add(singleturn(70, 225ms)), Joined::continued);
}

TEST(Unwrapper, DetectsJumpOfShaft) {
  // The speed limit of 6000 rpm is a tenth of a turn per ms.
  Unwrapper unwrapper(SpeedLimit{.rpm = 6000});
  EXPECT_FALSE(unwrapper.jumps(multiturn(9, 500, 0ms))) << "nothing is known yet";
  unwrapper.add(multiturn(5, 0, 0ms));
  EXPECT_FALSE(unwrapper.jumps(multiturn(5, 823, 1ms))) << "too fast, but no jump";
  EXPECT_TRUE(unwrapper.jumps(multiturn(5, 824, 1ms)));
  EXPECT_TRUE(unwrapper.jumps(multiturn(4, 200, 1ms)));
  EXPECT_TRUE(unwrapper.jumps(multiturn(6, 0, 1ms)));
  EXPECT_FALSE(unwrapper.jumps(multiturn(6, 0, 5ms)));
  Reading damaged = multiturn(6, 0, 1ms);
  damaged.singleturn_valid_bits = 5;
  EXPECT_FALSE(unwrapper.jumps(damaged)) << "no position";
  EXPECT_FALSE(unwrapper.jumps(multiturn(13, 0, 10min))) << "nobody knows";
}

TEST(Unwrapper, DetectsJumpOfCarriage) {
  Unwrapper unwrapper(SpeedLimit{.mm_s = 1000});
  Reading reading = singleturn(0, 0ms, 30);
  reading.unit_um = 1;
  unwrapper.add(reading);
  reading.latched = 9ms;
  for (const std::uint64_t counts : {40'004u, 40'005u}) {
    reading.singleturn = counts;
    EXPECT_EQ(unwrapper.jumps(reading), counts == 40'005u);
  }
}

TEST(Unwrapper, TakesPositionsOf64Bits) {
  Unwrapper unwrapper;
  unwrapper.add(singleturn(~std::uint64_t{0}, 0ms, 64));
  unwrapper.add(singleturn(3, 1ms, 64));
  EXPECT_EQ(unwrapper.position(), 3);
}

// The speeds are computed at compile time, where the compiler refuses an overflow.
TEST(Unwrapper, TakesExtremeSpeedsTimesAndUnits) {
  constexpr Time begin{-(std::int64_t{1} << 62)};
  constexpr Time years{std::int64_t{1} << 58};
  constexpr auto joined = [](const SpeedLimit& limit, Time from, Time to, double unit_um) {
    Unwrapper unwrapper(limit);
    Reading reading = singleturn(std::uint64_t{1} << 63, from, 64);
    reading.unit_um = unit_um;
    unwrapper.add(reading);
    reading.singleturn = 0;
    reading.latched = to;
    static_cast<void>(unwrapper.jumps(reading));
    return unwrapper.add(reading);
  };
  constexpr std::uint32_t fastest = 0xFFFF'FFFF;
  static_assert(joined({.rpm = 0}, begin, begin + years, 0) == Joined::continued);
  static_assert(joined({.rpm = fastest}, begin, begin + years, 0) == Joined::restarted);
  static_assert(joined({.rpm = fastest}, Time{}, Time(1), 0) == Joined::continued);
  static_assert(joined({.rpm = fastest}, years, Time{}, 0) == Joined::continued);
  static_assert(joined({.mm_s = fastest}, begin, begin + years, 1e-300) == Joined::restarted);
  static_assert(joined({.mm_s = fastest}, begin, begin + years, 1e300) == Joined::continued);
  static_assert(joined({.mm_s = 0}, begin, begin + years, 1) == Joined::continued);
}

TEST(LongestGap, IsNearlyHalfOfTheRangeAtFullSpeed) {
  EXPECT_EQ(longest_gap({.singleturn_bits = 17}, {.rpm = 6000}), Time(4'687'500));
  EXPECT_EQ(longest_gap({.singleturn_bits = 17, .multiturn_bits = 16}, {.rpm = 6000}), 307'200ms);
  EXPECT_EQ(longest_gap({.singleturn_bits = 20, .unit_um = 1}, {.mm_s = 1000}), Time(491'520'000));
  EXPECT_EQ(longest_gap({.multiturn_bits = 16}, {.rpm = 0}), never);
  EXPECT_EQ(longest_gap({.multiturn_bits = 64}, {.rpm = 1}), never);
}

TEST(Unwrapper, DoesNotJoinPositionsThatMayHaveBeenLatchedTooFarApart) {
  // At 10 000 rpm half a turn takes 3 ms. The reply of the third reading was late.
  Unwrapper unwrapper;
  unwrapper.add(singleturn(0, 0ms), {0ms, 1ms});
  EXPECT_EQ(unwrapper.add(singleturn(300, 1ms), {1ms, 2ms}), Joined::continued);
  EXPECT_EQ(unwrapper.add(singleturn(600, 2ms), {2ms, 5ms}), Joined::restarted);
  EXPECT_EQ(unwrapper.position(), 600);
  Reading late = singleturn(700, 6ms);
  late.received = 9ms;
  EXPECT_EQ(unwrapper.add(late), Joined::restarted) << "the times of the reading say the same";
}

TEST(Unwrapper, ReportsWhetherTurnsAreThoseOfTheEncoder) {
  Unwrapper single;
  single.add(singleturn(5, 0ms));
  EXPECT_FALSE(single.counts_turns());
  Unwrapper multi;
  multi.add(multiturn(3, 5, 0ms));
  EXPECT_TRUE(multi.counts_turns());
  multi.add(singleturn(6, 1ms));
  EXPECT_TRUE(multi.counts_turns()) << "it went on from there";
}

}  // namespace
}  // namespace absenc::host
