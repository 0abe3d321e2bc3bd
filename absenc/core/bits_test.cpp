// SPDX-License-Identifier: Apache-2.0
#include "absenc/core/bits.hpp"

#include <gtest/gtest.h>

#include <array>

namespace absenc {
namespace {

static_assert(low_mask(0) == 0 && low_mask(1) == 1 && low_mask(17) == 0x1FFFF);
static_assert(low_mask(63) == 0x7FFF'FFFF'FFFF'FFFF && low_mask(64) == 0xFFFF'FFFF'FFFF'FFFF);

static_assert(!odd_parity(0) && odd_parity(1) && !odd_parity(3) && odd_parity(std::uint64_t{1} << 63));

static_assert(reflect(0b001, 3) == 0b100 && reflect(0x5935, 16) == 0xAC9A);
static_assert(reflect(1, 32) == std::uint32_t{1} << 31 && reflect(1, 1) == 1);
static_assert(reflect(0xF1, 4) == 0x8, "bits above the width do not count");

constexpr std::array<std::uint8_t, 8> counting{1, 2, 3, 4, 5, 6, 7, 8};
static_assert(load_little_endian({}) == 0 && load_big_endian({}) == 0);
static_assert(load_little_endian(Bytes(counting).first(3)) == 0x030201);
static_assert(load_big_endian(Bytes(counting).first(3)) == 0x010203);
static_assert(load_little_endian(counting) == 0x0807'0605'0403'0201);
static_assert(load_big_endian(counting) == 0x0102'0304'0506'0708);

TEST(Bits, StoreIsTheInverseOfLoadForEveryWidth) {
  for (std::size_t size = 0; size <= 8; ++size) {
    const std::uint64_t value = 0xFEDC'BA98'7654'3210 & low_mask(static_cast<unsigned>(8 * size));
    std::array<std::uint8_t, 9> bytes{};
    bytes[size] = 0xA5;
    store_little_endian(MutableBytes(bytes).first(size), 0xFEDC'BA98'7654'3210);
    EXPECT_EQ(load_little_endian(Bytes(bytes).first(size)), value);
    store_big_endian(MutableBytes(bytes).first(size), 0xFEDC'BA98'7654'3210);
    EXPECT_EQ(load_big_endian(Bytes(bytes).first(size)), value);
    EXPECT_EQ(bytes[size], 0xA5) << "wrote past the end";
  }
}

TEST(Bits, ReflectTwiceIsTheValue) {
  for (unsigned width = 1; width <= 32; ++width) {
    const auto value = static_cast<std::uint32_t>(0x7F4A'7C15 & low_mask(width));
    EXPECT_EQ(reflect(reflect(value, width), width), value) << width << " bits";
  }
}

}  // namespace
}  // namespace absenc
