// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/text_lines.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace absenc::capture {
namespace {

TEST(TextLines, SecondsAreTheSameHoweverTheyAreWritten) {
  std::mt19937 random(9);
  const auto digits = [&](std::size_t count) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i) text += static_cast<char>('0' + random() % 10);
    return text;
  };
  for (unsigned round = 0; round < 20'000; ++round) {
    std::string number = random() % 4 == 0 ? "-" : "";
    number += digits(random() % 21);
    if (random() % 8 != 0) number += '.' + digits(random() % 16);
    if (random() % 50 == 0) number += "x";
    const auto usual = parse_seconds(number);
    const auto with_exponent = parse_seconds(number + "e0");
    ASSERT_EQ(usual.has_value(), with_exponent.has_value()) << number;
    if (!usual) continue;
    EXPECT_EQ(usual->seconds, with_exponent->seconds) << number;
    EXPECT_EQ(usual->picoseconds, with_exponent->picoseconds) << number;
  }
}

TEST(TextLines, Seconds) {
  const auto is = [](std::string_view text, std::int64_t seconds, std::int64_t picoseconds) {
    const auto instant = parse_seconds(text);
    return instant && instant->seconds == seconds && instant->picoseconds == picoseconds;
  };
  EXPECT_TRUE(is("12", 12, 0));
  EXPECT_TRUE(is("12.5", 12, 500'000'000'000));
  EXPECT_TRUE(is("+0.000000000001", 0, 1));
  EXPECT_TRUE(is("0.0000000000019", 0, 1));
  EXPECT_TRUE(is("-0.000125", -1, 999'875'000'000));
  EXPECT_TRUE(is("1.8e-08", 0, 18'000));
  EXPECT_TRUE(is("999999999999999999.999999999999", 999'999'999'999'999'999, 999'999'999'999));
  for (const std::string_view text : {"", "-", ".", "1.2.3", " 1", "1 ", "1000000000000000000.0", "0x1", "12:00"}) {
    EXPECT_FALSE(parse_seconds(text)) << text;
  }
}

TEST(TextLines, BlanksAreTrimmed) {
  EXPECT_EQ(trim("\t 1 2\r\n"), "1 2");
  EXPECT_EQ(trim(" \t\r\n"), "");
  EXPECT_EQ(trim(""), "");
}

}  // namespace
}  // namespace absenc::capture
