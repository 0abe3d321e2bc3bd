// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/text/real_number.hpp"

#include <gtest/gtest.h>

namespace absenc::client {
namespace {

TEST(ParseReal, TakesFiniteDecimalNumbersOnly) {
  EXPECT_EQ(parse_real("12.5"), 12.5);
  EXPECT_EQ(parse_real("+12.5"), 12.5);
  EXPECT_EQ(parse_real("-1e3"), -1000.0);
  EXPECT_EQ(parse_real(".5"), 0.5);
  for (const char* const text : {"", " 1", "1 ", "+-5", "++5", "0x10", "inf", "nan", "1e999", "12,5", "1.2.3"}) {
    EXPECT_EQ(parse_real(text), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace absenc::client
