// SPDX-License-Identifier: Apache-2.0
#include "absenc/core/bit_view.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace absenc {
namespace {

constexpr std::array<std::uint8_t, 10> bytes{0x80, 0xFF, 0x12, 0x34, 0x56, 0x78, 0x9A, 0xBC, 0xDE, 0xF0};

// The buffers include some shorter than a machine word, and the loads reach the end of each buffer.
TEST(BitView, LoadsAnyRunAtAnyPlace) {
  for (std::size_t size = 8; size <= 80; size += 8) {
    const std::vector<std::uint8_t> end(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size / 8));
    const BitView bits{end, size};
    for (std::size_t first = 0; first < size; ++first) {
      for (unsigned count = 0; count <= 64 && first + count <= size; ++count) {
        std::uint64_t value = 0;
        for (std::size_t i = first; i < first + count; ++i) value = value << 1 | (bits[i] ? 1 : 0);
        EXPECT_EQ(bits.load(first, count), value) << first << ' ' << count;
      }
    }
  }
  EXPECT_EQ((BitView{bytes, 80}.load(0, 64)), 0x80FF123456789ABCu);
}

TEST(BitNumber, LoadsAsTheViewOfItsBits) {
  const BitView bits{bytes, 80};
  for (unsigned size = 1; size <= 64; ++size) {
    const BitNumber number{bits.load(5, size), size};
    for (unsigned first = 0; first < size; ++first) {
      for (unsigned count = 0; first + count <= size; ++count) {
        EXPECT_EQ(number.load(first, count), bits.load(5 + first, count)) << size << ' ' << first << ' ' << count;
      }
    }
  }
}

TEST(BitView, FindsTheEndOfARunOfAnyLength) {
  for (std::size_t begin = 0; begin < 20; ++begin) {
    for (std::size_t length = 1; length <= 200; ++length) {
      for (const bool level : {false, true}) {
        BitBuffer<256> buffer;
        for (std::size_t i = 0; i < begin; ++i) buffer.append(level ? 0 : 1, 1);
        for (std::size_t i = 0; i < length; ++i) buffer.append(level ? 1 : 0, 1);
        const std::vector<std::uint8_t> exact(buffer.bytes().begin(), buffer.bytes().end());
        EXPECT_EQ((BitView{exact, begin + length}.end_of_run(begin)), begin + length) << begin << ' ' << length;
        buffer.append(level ? 0 : 1, 1);
        EXPECT_EQ(buffer.view().end_of_run(begin), begin + length) << begin << ' ' << length;
      }
    }
  }
}

TEST(BitView, FindsTheEndOfARun) {
  const BitView bits{bytes, 18};  // the bits are 1 0000000 11111111 00
  EXPECT_EQ(bits.end_of_run(0), 1u);
  EXPECT_EQ(bits.end_of_run(1), 8u);
  EXPECT_EQ(bits.end_of_run(3), 8u);
  EXPECT_EQ(bits.end_of_run(8), 16u);
  // the run of equal bits ends with the view, because bits behind the view do not count
  EXPECT_EQ(bits.end_of_run(16), 18u);
}

TEST(BitBuffer, ReturnsAppendedBits) {
  BitBuffer<70> buffer;
  EXPECT_TRUE(buffer.append(0b101, 3));
  EXPECT_TRUE(buffer.append(0x1234'5678'9ABC'DEF0, 64));
  EXPECT_FALSE(buffer.append(0, 4));
  EXPECT_TRUE(buffer.append(7, 3));
  EXPECT_EQ(buffer.size(), 70u);
  EXPECT_EQ(buffer.view().load(0, 3), 0b101u);
  EXPECT_EQ(buffer.view().load(3, 64), 0x1234'5678'9ABC'DEF0u);
  EXPECT_EQ(buffer.bytes().size(), 9u);
  EXPECT_EQ(buffer.bytes()[8], 0b00011100);
  buffer.clear();
  EXPECT_EQ(buffer.size(), 0u);
  EXPECT_TRUE(buffer.append(0, 8));
  EXPECT_EQ(buffer.bytes()[0], 0);
}

TEST(BitView, CrcOfAnyNumberOfBitsEqualsDefinition) {
  constexpr CrcParameters six{6, 0x03, 0, false, false, 0x3F};
  constexpr CrcParameters sixteen{16, 0x90D9, 0, false, false, 0xFFFF};
  const BitView bits{bytes, 80};
  for (std::size_t first = 0; first < 16; ++first) {
    for (std::size_t count = 0; first + count <= 80; ++count) {
      std::uint32_t small = 0;
      std::uint32_t large = 0;
      for (std::size_t i = first; i < first + count; ++i) {
        small = small << 1 ^ (((small >> 5 & 1) != 0) != bits[i] ? 0x43u : 0);
        large = large << 1 ^ (((large >> 15 & 1) != 0) != bits[i] ? 0x190D9u : 0);
        small &= 0x3F;
        large &= 0xFFFF;
      }
      EXPECT_EQ(crc_of<six>(bits, first, count), small ^ 0x3F) << first << ' ' << count;
      EXPECT_EQ((crc_of<sixteen, CrcTable::nibble>(bits, first, count)), large ^ 0xFFFF) << first << ' ' << count;
    }
  }
}

}  // namespace
}  // namespace absenc
