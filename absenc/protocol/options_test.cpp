// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/options.hpp"

#include <gtest/gtest.h>

namespace absenc {
namespace {

TEST(Options, DecimalNumbers) {
  EXPECT_EQ(parse_decimal("0.05", 3).value(), 50);
  EXPECT_EQ(parse_decimal("0.050", 3).value(), 50);
  EXPECT_EQ(parse_decimal("12", 3).value(), 12'000);
  EXPECT_EQ(parse_decimal("1.16", 2).value(), 116);
  EXPECT_EQ(parse_decimal("9223372036854775807", 0).value(), INT64_MAX);
}

TEST(Options, WhatIsNoDecimalNumber) {
  for (const char* text : {"", ".", "1.", ".5", "-1", "0.0005", "1.2.3", "1,5", "0x10", "1e3", "1.-5", " 1", "1.5 ",
                           "9223372036854775807"}) {
    EXPECT_EQ(parse_decimal(text, 3).error(), Error::invalid_argument) << text;
  }
}

}  // namespace
}  // namespace absenc
