// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/unwrap.hpp"

#include <gtest/gtest.h>

namespace absenc::host {
namespace {

using Joined = Unwrapper::Joined;
using namespace std::chrono_literals;

Reading singleturn(std::uint64_t counts, Time at, unsigned bits = 10) {
  return {.singleturn = counts, .singleturn_bits = bits, .singleturn_valid_bits = bits, .latched = at};
}

Reading multiturn(std::uint64_t turns, std::uint64_t counts, Time at) {
  Reading reading = singleturn(counts, at);
  reading.multiturn = turns;
  reading.multiturn_bits = 4;
  reading.multiturn_valid = true;
  return reading;
}

TEST(Unwrapper, GoesOnPastTheEndOfATurn) {
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

TEST(Unwrapper, GoesOnPastTheEndOfTheTurnCounter) {
  Unwrapper unwrapper;
  unwrapper.add(multiturn(15, 1000, 0ms));
  EXPECT_EQ(unwrapper.position(), 15 * 1024 + 1000);
  unwrapper.add(multiturn(2, 8, 1ms));
  EXPECT_EQ(unwrapper.position(), 18 * 1024 + 8);
  unwrapper.add(multiturn(15, 1023, 2ms));
  EXPECT_EQ(unwrapper.position(), 15 * 1024 + 1023);
}

TEST(Unwrapper, TakesTheTurnOnlyWhereTheTurnsDoNotHold) {
  Unwrapper unwrapper;
  unwrapper.add(multiturn(5, 1000, 0ms));
  Reading lost = multiturn(0, 8, 1ms);
  lost.multiturn_valid = false;
  EXPECT_EQ(unwrapper.add(lost), Joined::continued);
  EXPECT_EQ(unwrapper.position(), 6 * 1024 + 8);
  // Valid again, but to other turns: there is no way that would join them.
  EXPECT_EQ(unwrapper.add(multiturn(0, 20, 2ms)), Joined::continued);
  EXPECT_EQ(unwrapper.position(), 6 * 1024 + 20);
}

TEST(Unwrapper, IgnoresWhatIsNotValid) {
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

TEST(Unwrapper, DoesNotJoinWhatIsTooFarApart) {
  Unwrapper unwrapper(5ms);
  unwrapper.add(singleturn(1000, 0ms));
  EXPECT_EQ(unwrapper.add(singleturn(10, 5ms)), Joined::continued);
  EXPECT_EQ(unwrapper.position(), 1034);
  EXPECT_EQ(unwrapper.add(singleturn(20, 10ms + 1ns)), Joined::started);
  EXPECT_EQ(unwrapper.position(), 20);
}

TEST(Unwrapper, TakesPositionsOf64Bits) {
  Unwrapper unwrapper;
  unwrapper.add(singleturn(~std::uint64_t{0}, 0ms, 64));
  unwrapper.add(singleturn(3, 1ms, 64));
  EXPECT_EQ(unwrapper.position(), 3);
}

TEST(LongestGap, IsHalfOfTheRangeAtFullSpeed) {
  EXPECT_EQ(longest_gap(0, 6000), 5ms);
  EXPECT_EQ(longest_gap(16, 6000), 327'680ms);
  EXPECT_EQ(longest_gap(16, 0), never);
  EXPECT_EQ(longest_gap(64, 1), never);
}

}  // namespace
}  // namespace absenc::host
