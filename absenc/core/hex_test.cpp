// SPDX-License-Identifier: Apache-2.0
#include "absenc/core/hex.hpp"

#include <gtest/gtest.h>

namespace absenc {
namespace {

template <HexLiteral literal>
concept Compiles = requires {
  hex<literal>;
};

TEST(Hex, LiteralHasItsBytes) {
  EXPECT_EQ(hex<"1A 00ff">, (std::array<std::uint8_t, 3>{0x1A, 0x00, 0xFF}));
  EXPECT_TRUE(hex<"">.empty());
}

TEST(Hex, OnlyPairsOfDigitsCompile) {
  EXPECT_TRUE(Compiles<"1A 00">);
  EXPECT_FALSE(Compiles<"zz">);
  EXPECT_FALSE(Compiles<"1">);
  EXPECT_FALSE(Compiles<"1 A">);
}

}  // namespace
}  // namespace absenc
