// SPDX-License-Identifier: Apache-2.0
// The host conversation and the virtual encoder against each other in virtual time.
#include "absenc/protocol/ssi/host.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/biss/bench_test.hpp"
#include "absenc/protocol/ssi/device.hpp"

namespace absenc::ssi {
namespace {

using biss::testing::report;
using Bench = biss::testing::ClockedBench<VirtualEncoder>;

const Format bits_12{};

std::string_view last_rule(const Bench& bench) {
  return bench.encoder.violations().empty() ? "" : bench.encoder.violations().back().rule;
}

TEST(SsiHost, ReadsTheWord) {
  Bench bench(line_settings, bits_12);
  bench.shaft.state.position = std::int64_t{495} << 20;
  ReadPosition read(bits_12);
  bench.run(read);
  ASSERT_EQ(read.error(), Error::none);
  EXPECT_EQ(report(read), (std::map<std::string, std::int64_t>{{"singleturn", 495}, {"angle_deg", 43}}));
  EXPECT_EQ(read.reading()->latched, 510us);
  EXPECT_EQ(read.reading()->received, 510us + 12 * 5us);
  EXPECT_TRUE(read.reading()->singleturn_valid());
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(SsiHost, ReadingsKeepThePause) {
  Bench bench(line_settings, bits_12);
  for (int i = 0; i < 5; ++i) {
    bench.shaft.state.position = std::int64_t{i} << 20;
    ReadPosition read(bits_12);
    EXPECT_EQ(bench.run(read).reading()->singleturn, static_cast<std::uint64_t>(i));
  }
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
  EXPECT_EQ(bench.encoder.answered(), 5u);
}

TEST(SsiHost, ThePauseVariesByProduct) {
  for (const Time pause : {Time(20us), Time(2ms), Time(100ms)}) {
    Bench bench(line_settings, bits_12, Timing{.pause = pause});
    bench.shaft.state.position = std::int64_t{495} << 20;
    ReadPosition first(bits_12, pause);
    EXPECT_EQ(bench.run(first).reading()->singleturn, 495u);
    bench.shaft.state.position = 0;
    ReadPosition second(bits_12, pause);
    EXPECT_EQ(bench.run(second).reading()->singleturn, 0u);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
  Bench slow(line_settings, bits_12, Timing{.pause = 2ms});
  slow.shaft.state.position = std::int64_t{495} << 20;
  for (int i = 0; i < 2; ++i) {
    ReadPosition read(bits_12);
    slow.run(read);
  }
  EXPECT_EQ(last_rule(slow), "clocked again within pause_us");
}

TEST(SsiDevice, TheClockVariesByProduct) {
  Bench bench(line_settings, bits_12, Timing{.shortest_period = 1us, .longest_period = 2us});
  bench.clock(12, 1ms, 1'000'000);
  bench.clock(12, 1ms, 500'000);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
  bench.clock(12, 1ms, 400'000);
  EXPECT_EQ(last_rule(bench), "clock outside min_clock_khz to max_clock_khz");
}

TEST(SsiHost, TurnsGrayParityAndErrorBit) {
  const Format format{.word = word_with({.position = 13, .multiturn = 12}, true, ErrorBit::active_low, Parity::odd),
                      .extra_clocks = 27};
  Bench bench(line_settings, format);
  bench.shaft.state.position = (std::int64_t{-2} << 32) + (std::int64_t{0x1234} << 19);
  ReadPosition read(format);
  ASSERT_EQ(bench.run(read).error(), Error::none);
  EXPECT_EQ(read.reading()->multiturn, 4094u);
  EXPECT_EQ(read.reading()->singleturn, 0x1234u);
  bench.encoder.raise_alarms(word_error);
  ReadPosition alarmed(format);
  ASSERT_EQ(bench.run(alarmed).error(), Error::none);
  EXPECT_FALSE(alarmed.reading()->singleturn_valid());
  EXPECT_EQ(alarmed.reading()->alarms, word_error);
}

TEST(SsiHost, AnEncoderWithoutSupplyIsSeenWhereTheLineAllowsIt) {
  const Format format{.after_word = AfterWord::zero, .extra_clocks = 1};
  Bench bench(line_settings, format);
  bench.encoder.power_off(Time{});
  ReadPosition read(format);
  EXPECT_EQ(bench.run(read).error(), Error::line_stuck);
  EXPECT_EQ(read.reading(), nullptr);
  EXPECT_TRUE(report(read).empty());
}

TEST(SsiHost, AWrongNumberOfBitsIsSeenByReadingTwice) {
  Bench bench(line_settings, bits_12);
  bench.shaft.state.position = std::int64_t{495} << 20;
  const Format wrong{.word = word_format({.position = 13}), .extra_clocks = 13};
  ReadPosition read(wrong);
  EXPECT_EQ(bench.run(read).error(), Error::cross_check_failed);
  EXPECT_NE(read.detail().find("number of bits"), std::string_view::npos);
}

// ---- The virtual encoder, clocked by hand

TEST(SsiDevice, RepeatsItsWordOrSendsZerosOrOnes) {
  for (const auto& [after, wanted] :
       std::to_array<std::pair<AfterWord, std::string_view>>({{AfterWord::repeat, "0001111011110001"},
                                                              {AfterWord::zero, "0001111011110000"},
                                                              {AfterWord::one, "0001111011111111"}})) {
    Bench bench(line_settings, Format{.after_word = after});
    bench.shaft.state.position = std::int64_t{495} << 20;
    EXPECT_EQ(bench.clock(16), wanted);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

TEST(SsiDevice, GoesOnWithTheOldWordWithinThePause) {
  Bench bench(line_settings, bits_12);
  bench.shaft.state.position = std::int64_t{495} << 20;
  EXPECT_EQ(bench.clock(12), "000111101111");
  bench.shaft.state.position = 0;
  EXPECT_EQ(bench.clock(4, 499us), "0001");
  EXPECT_EQ(last_rule(bench), "clocked again within pause_us");
  EXPECT_EQ(bench.clock(12, 100us), "111011110001");
  EXPECT_EQ(bench.clock(12, 500us), "000000000000");
  EXPECT_EQ(bench.encoder.violation_count(), 2u);
}

TEST(SsiDevice, ReportsTooFewClocksAndAWrongRate) {
  Bench bench(line_settings, bits_12);
  EXPECT_EQ(bench.clock(8).size(), 8u);
  EXPECT_EQ(last_rule(bench), "fewer clocks than the word has bits");
  bench.clock(12, 1ms, 300'000);
  EXPECT_EQ(last_rule(bench), "clock outside min_clock_khz to max_clock_khz");
  bench.clock(12, 1ms, 90'000);
  EXPECT_EQ(bench.encoder.violation_count(), 3u);
  bench.clock(12, 1ms, 250'000);
  bench.clock(12, 1ms, 100'000);
  EXPECT_EQ(bench.encoder.violation_count(), 3u);
}

}  // namespace
}  // namespace absenc::ssi
