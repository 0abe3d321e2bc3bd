// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/velocity.hpp"

#include <gtest/gtest.h>

namespace absenc::host {
namespace {

using namespace std::chrono_literals;

TEST(Velocity, NeedsTwoPositions) {
  Velocity velocity;
  EXPECT_FALSE(velocity.valid());
  velocity.add(100, 1ms);
  EXPECT_FALSE(velocity.valid());
  EXPECT_EQ(velocity.counts_per_second(), 0);
  EXPECT_EQ(velocity.delay(), 0ms);
  velocity.add(90, 2ms);
  EXPECT_TRUE(velocity.valid());
  EXPECT_EQ(velocity.counts_per_second(), -10'000);
  EXPECT_EQ(velocity.delay(), 500us);
  velocity.restart();
  EXPECT_FALSE(velocity.valid());
}

TEST(Velocity, IsTheMeanOverItsWindow) {
  Velocity velocity(10ms);
  for (int i = 0; i <= 100; ++i) velocity.add(i < 50 ? 0 : (i - 50) * 7, i * 1ms);
  EXPECT_EQ(velocity.counts_per_second(), 7000);
  EXPECT_EQ(velocity.delay(), 5ms);
}

TEST(Velocity, IsAStepWhereReadingsAreRare) {
  Velocity velocity(10ms);
  velocity.add(0, 0s);
  velocity.add(5, 1s);
  velocity.add(25, 2s);
  EXPECT_EQ(velocity.counts_per_second(), 20);
  EXPECT_EQ(velocity.delay(), 500ms);
}

TEST(Velocity, KeepsAsManyPositionsAsItHasRoomFor) {
  Velocity velocity(1s);
  for (int i = 0; i < 1000; ++i) velocity.add(i * i, i * 1us);
  EXPECT_EQ(velocity.delay(), (Velocity::most_positions - 1) * 1000ns / 2);
}

TEST(Velocity, DoesNotTakeWhatIsNotLater) {
  Velocity velocity;
  velocity.add(0, 1ms);
  velocity.add(10, 2ms);
  velocity.add(500, 2ms);
  velocity.add(600, 1ms);
  EXPECT_EQ(velocity.counts_per_second(), 10'000);
}

}  // namespace
}  // namespace absenc::host
