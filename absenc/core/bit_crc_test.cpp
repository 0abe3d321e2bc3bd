// SPDX-License-Identifier: Apache-2.0
#include "absenc/core/bit_crc.hpp"

#include <gtest/gtest.h>

#include <array>

#include "absenc/sim/random.hpp"

namespace absenc {
namespace {

static_assert(BitCrc<>({16, 0x1021, 0xFFFF, false, false, 0x0000}, 64)(0x3132'3334'3536'3738) == 0xA12B,
              "CRC-16/IBM-3740 of \"12345678\"");
static_assert(BitCrc<std::uint8_t, 4>({6, 0x03, 0, false, false, 0x3F}, 13)(0) == 0x3F, "zeros, inverted");

TEST(BitCrc, EqualsDefinitionForEveryWidthAndLength) {
  sim::Random random(3);
  for (unsigned width = 3; width <= 16; ++width) {
    for (unsigned bytes = 1; bytes <= 8; ++bytes) {
      for (unsigned i = 0; i < 50; ++i) {
        const auto mask = static_cast<std::uint16_t>(low_mask(width));
        const auto any = [&] { return static_cast<std::uint16_t>(random.next() & mask); };
        const CrcParameters parameters{width, any(), any(), false, false, any()};
        const std::uint64_t bits = random.next() & low_mask(8 * bytes);
        std::array<std::uint8_t, 8> stored{};
        store_big_endian(MutableBytes(stored).first(bytes), bits);
        const std::uint16_t expected = crc_bitwise(parameters, Bytes(stored).first(bytes));
        ASSERT_EQ(BitCrc<>(parameters, 8 * bytes)(bits), expected) << width << " bits over " << bytes << " bytes";
        if (width > 8) continue;
        ASSERT_EQ(BitCrc<std::uint8_t>(parameters, 8 * bytes)(bits), expected) << width << " over " << bytes;
      }
    }
  }
}

// If the number of bits is no multiple of 4, only a part of the last row of the CRC table is used.
TEST(BitCrc, LeadingZerosChangeOnlyInitialValue) {
  sim::Random random(4);
  const CrcParameters parameters{16, 0x90D9, 0, false, false, 0xFFFF};
  for (unsigned count = 1; count <= 64; ++count) {
    const std::uint64_t bits = random.next() & low_mask(count);
    EXPECT_EQ(BitCrc<>(parameters, count)(bits), BitCrc<>(parameters, 64)(bits)) << count;
  }
}

TEST(BitCrc, WidthZeroGivesZero) {
  const BitCrc<> none({0, 0x3, 0x1, false, false, 0}, 20);
  EXPECT_EQ(none(0xFFFFF), 0);
}

}  // namespace
}  // namespace absenc
