// SPDX-License-Identifier: Apache-2.0
#include "absenc/core/gray.hpp"

#include <gtest/gtest.h>

#include <bit>

#include "absenc/core/bits.hpp"

namespace absenc {
namespace {

static_assert(gray_encode(0) == 0 && gray_encode(1) == 1 && gray_encode(2) == 3 && gray_encode(3) == 2);
static_assert(gray_encode(0xFFFF'FFFF'FFFF'FFFF) == std::uint64_t{1} << 63);
static_assert(gray_decode(std::uint64_t{1} << 63) == 0xFFFF'FFFF'FFFF'FFFF);
static_assert(gray_decode(0x10000) == 0x1FFFF, "17 bits: four shifts are not enough");

constexpr bool steps_by_one_bit(std::uint64_t count) {
  return std::popcount(gray_encode(count) ^ gray_encode(count + 1)) == 1 && gray_decode(gray_encode(count)) == count;
}

TEST(Gray, NeighboursDifferInOneBitAndDecodeIsTheInverse) {
  for (std::uint64_t count = 0; count < 1 << 18; ++count) ASSERT_TRUE(steps_by_one_bit(count)) << count;
  // Tests the 64 counts before each carry into a bit from 18 on, and before the wrap to 0.
  for (unsigned bits = 18; bits <= 64; ++bits) {
    for (std::uint64_t back = 0; back < 64; ++back) {
      ASSERT_TRUE(steps_by_one_bit(low_mask(bits) - back)) << bits << " bits, " << back << " before the carry";
    }
    EXPECT_EQ(std::popcount(gray_encode(low_mask(bits))), 1) << bits << " bits: the step across zero";
  }
}

}  // namespace
}  // namespace absenc
