// SPDX-License-Identifier: Apache-2.0
#include "absenc/core/angle.hpp"

#include <gtest/gtest.h>

namespace absenc {
namespace {

static_assert(degrees(0, 17) == 0.0);
static_assert(degrees(495, 12) == 43.505859375, "495 / 4096 of a circle, not 495 / 4095");
static_assert(degrees(1 << 16, 17) == 180.0 && degrees(1 << 22, 23) == 180.0);
static_assert(degrees(65535, 16) == 360.0 - 360.0 / 65536, "the last count stays below the full circle");
static_assert(degrees((std::uint64_t{1} << 32) - 1, 32) < 360.0);

static_assert(wrapped_difference(5, 3, 17) == 2 && wrapped_difference(3, 5, 17) == -2);
static_assert(wrapped_difference(0, 0x1FFFF, 17) == 1, "forward across zero");
static_assert(wrapped_difference(0x1FFFF, 0, 17) == -1, "back across zero");
static_assert(wrapped_difference(0x0FFFF, 0, 17) == 65535 && wrapped_difference(0x10000, 0, 17) == -65536);
static_assert(wrapped_difference(1, 0, 1) == -1);
static_assert(wrapped_difference(low_mask(63), 0, 63) == -1);

constexpr Reading reading(unsigned valid_bits) {
  Reading made;
  made.singleturn_bits = 17;
  made.singleturn_valid_bits = valid_bits;
  return made;
}
static_assert(reading(17).singleturn_valid() && !reading(5).singleturn_valid() && !reading(0).singleturn_valid());
static_assert(!Reading{}.singleturn_valid(), "without a position there is nothing valid");

TEST(Angle, WrappedDifferenceLeadsFromOneToTheOther) {
  constexpr unsigned bits = 6;
  for (std::uint64_t from = 0; from < 64; ++from) {
    for (std::uint64_t to = 0; to < 64; ++to) {
      const std::int64_t difference = wrapped_difference(to, from, bits);
      EXPECT_GE(difference, -32);
      EXPECT_LT(difference, 32);
      EXPECT_EQ((from + static_cast<std::uint64_t>(difference)) & low_mask(bits), to);
    }
  }
}

TEST(Angle, DegreesRiseWithEveryCount) {
  for (std::uint64_t counts = 1; counts < 1 << 17; ++counts) {
    ASSERT_GT(degrees(counts, 17), degrees(counts - 1, 17));
  }
}

}  // namespace
}  // namespace absenc
