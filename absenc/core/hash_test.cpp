// SPDX-License-Identifier: Apache-2.0
#include "absenc/core/hash.hpp"

#include <gtest/gtest.h>

#include <array>

namespace absenc {
namespace {

// The values of "", "a" and "foobar" in the test suite of the hash's authors (draft-eastlake-fnv, test vectors).
TEST(Hash, HasTheValuesOfItsAuthors) {
  constexpr std::array<std::uint8_t, 6> text{'f', 'o', 'o', 'b', 'a', 'r'};
  constexpr std::array<std::uint8_t, 1> letter{'a'};
  EXPECT_EQ(fnv1a({}), 0x811C'9DC5U);
  EXPECT_EQ(fnv1a(letter), 0xE40C'292CU);
  EXPECT_EQ(fnv1a(text), 0xBF9C'F968U);
  EXPECT_EQ(fnv1a(Bytes(text).subspan(2), fnv1a(Bytes(text).first(2))), 0xBF9C'F968U);
}

}  // namespace
}  // namespace absenc
