// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/random.hpp"

#include <gtest/gtest.h>

#include <array>

namespace absenc::sim {
namespace {

// The expected numbers are from https://rosettacode.org/wiki/Pseudo-random_numbers/Splitmix64, for seed 1234567.
TEST(Random, NumbersAreThePublishedOnes) {
  Random random(1234567);
  EXPECT_EQ(random.next(), 6457827717110365317u);
  EXPECT_EQ(random.next(), 3203168211198807973u);
  EXPECT_EQ(random.next(), 9817491932198370423u);
}

TEST(Random, BelowReachesEveryNumberEquallyOften) {
  Random random(1);
  std::array<int, 6> counts{};
  for (int i = 0; i < 60'000; ++i) ++counts.at(static_cast<std::size_t>(random.below(6)));
  for (const int count : counts) EXPECT_NEAR(count, 10'000, 400);
  EXPECT_EQ(random.below(1), 0u);
}

TEST(Random, BelowIsNotSkewedByAHugeLimit) {
  Random random(2);
  // With the limit 3 * 2^62, plain `value % limit` would make the lower third twice as likely.
  const std::uint64_t limit = std::uint64_t{3} << 62;
  int lower_third = 0;
  for (int i = 0; i < 30'000; ++i) lower_third += random.below(limit) < limit / 3 ? 1 : 0;
  EXPECT_NEAR(lower_third, 10'000, 400);
}

TEST(Random, ChanceKeepsItsProbability) {
  Random random(3);
  int never = 0;
  int always = 0;
  int sometimes = 0;
  for (int i = 0; i < 10'000; ++i) {
    never += random.chance(0) ? 1 : 0;
    always += random.chance(1) ? 1 : 0;
    sometimes += random.chance(0.25) ? 1 : 0;
  }
  EXPECT_EQ(never, 0);
  EXPECT_EQ(always, 10'000);
  EXPECT_NEAR(sometimes, 2'500, 200);
}

}  // namespace
}  // namespace absenc::sim
