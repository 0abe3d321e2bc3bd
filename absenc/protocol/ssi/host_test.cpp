// SPDX-License-Identifier: Apache-2.0
// Tests of the SSI host and of the virtual encoder.
#include "absenc/protocol/ssi/host.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>

#include <vector>

#include "absenc/protocol/biss/bench_test.hpp"
#include "absenc/protocol/options.hpp"
#include "absenc/protocol/ssi/device.hpp"
#include "absenc/protocol/ssi/unit.hpp"

namespace absenc::ssi {
namespace {

/// An encoder, by default of 12 bits, at 495/4096 of a turn, which is the example of the manual.
struct Bench : biss::testing::ClockedBench<VirtualEncoder> {
  explicit Bench(const Format& format = {}) : ClockedBench(line_settings, format) {
    shaft.state.position = std::int64_t{495} << 20;
  }
  std::uint64_t read(const Format& format) {
    ReadPosition reading(format);
    run(reading);
    EXPECT_EQ(reading.error(), Error::none);
    return reading.reading() == nullptr ? ~std::uint64_t{0} : reading.reading()->singleturn;
  }
  Error error(const Format& format) {
    ReadPosition reading(format);
    run(reading);
    EXPECT_EQ(reading.reading(), nullptr);
    return reading.error();
  }
};

TEST(SsiHost, ReadsWord) {
  Bench bench;
  ReadPosition read({});
  bench.run(read);
  ASSERT_EQ(read.error(), Error::none);
  EXPECT_EQ(read.reading()->singleturn, 495u);
  EXPECT_EQ(read.reading()->latched, 60us);
  EXPECT_EQ(read.reading()->received, 60us + 12 * 5us);
  EXPECT_TRUE(read.reading()->singleturn_valid());
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(SsiHost, UsesPauseOfFormat) {
  for (const Time pause : {Time(20us), Time(500us), Time(100ms)}) {
    const Format format{.pause = pause, .monoflop = Time{}};
    Bench bench(format);
    EXPECT_EQ(bench.read(format), 495u);
    bench.shaft.state.position = 0;
    EXPECT_EQ(bench.read(format), 0u);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
    EXPECT_EQ(bench.encoder.answer_count(), 2u);
  }
  Bench slow({.pause = 2ms, .monoflop = Time{}});
  for (int i = 0; i < 2; ++i) EXPECT_NE(slow.read({}), 0u);
  EXPECT_EQ(slow.last_rule(), "clocked again within monoflop_us");
}

TEST(SsiHost, ReadsTurnsGrayCodeParityAndErrorBit) {
  const Format format{.word = word_with({.position = 13, .multiturn = 12}, true, ErrorBit::active_low, Parity::odd),
                      .extra_clocks = 27};
  Bench bench(format);
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

TEST(SsiHost, ReportsStuckLineWithoutSupply) {
  const Format format{.after_word = AfterWord::zero, .extra_clocks = 1};
  Bench bench(format);
  bench.encoder.power_off(Time{});
  EXPECT_EQ(bench.error(format), Error::line_stuck);
}

TEST(SsiHost, ReadingTwiceDetectsWrongNumberOfBits) {
  EXPECT_EQ(Bench().error({.word = word_format({.position = 13}), .extra_clocks = 13}), Error::cross_check_failed);
}

TEST(SsiHost, RejectsSecondWordThatIsTooFarAway) {
  const Format format{.word = word_format({.position = 17}), .confirm_rpm = 6000};
  const Word at{.position = 1000};
  EXPECT_TRUE(can_follow(format, at, at, 100us));
  // At 6000 rpm, 100 turns a second, the position of 17 bits changes by 1310 counts in 100 us.
  EXPECT_TRUE(can_follow(format, at, {.position = 2300}, 100us));
  EXPECT_TRUE(can_follow(format, at, {.position = (1u << 17) - 300}, 100us));
  EXPECT_FALSE(can_follow(format, at, {.position = 2330}, 100us));
  EXPECT_FALSE(can_follow(format, at, {.position = 1000 + (1u << 16)}, 100us));

  Bench bench(format);
  ConfirmPosition read(format);
  EXPECT_EQ(bench.run(read).error(), Error::none);
  EXPECT_NE(read.reading(), nullptr);
  EXPECT_EQ(bench.encoder.answer_count(), 2u);

  // The shaft moves half a turn between the two words: wrong bits on a noisy line look like this.
  bench.line.observe_transfers([&](const auto&) { bench.shaft.state.position += std::int64_t{1} << 31; });
  ConfirmPosition jumped(format);
  EXPECT_EQ(bench.run(jumped).error(), Error::cross_check_failed);
  EXPECT_EQ(jumped.reading(), nullptr);
}

TEST(SsiHost, ExplainsErrors) {
  const auto detail_of = [](Error error, std::vector<OptionText> texts) {
    Options options;
    EXPECT_EQ(resolve_options(unit, {}, texts, options).kind, OptionError::Kind::none);
    return unit.explain(options, error, {}, {}).detail;
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(detail_of(Error::cross_check_failed, {}), HasSubstr("number of bits may be wrong"));
  EXPECT_THAT(detail_of(Error::cross_check_failed, {{"confirm_rpm", "6000"}}), HasSubstr("cannot have reached"));
  EXPECT_THAT(detail_of(Error::bad_checksum, {}), HasSubstr("parity"));
  EXPECT_THAT(detail_of(Error::out_of_range, {{"tree_turns", "12"}, {"tree_steps", "13"}}),
              HasSubstr("fills the word up"));
  EXPECT_THAT(detail_of(Error::out_of_range, {}), HasSubstr("more clocks than the word has bits"));
  // The unit does not explain line_stuck and wrong_length.
  for (const Error error : {Error::line_stuck, Error::wrong_length}) EXPECT_EQ(detail_of(error, {}), "");
}

TEST(SsiHost, InvertedParityInvalidatesPosition) {
  const Format format{.word = word_with({.position = 13}, false, ErrorBit::none, Parity::even), .error_parity = true};
  Bench bench(format);
  ReadPosition good(format);
  ASSERT_EQ(bench.run(good).error(), Error::none);
  EXPECT_TRUE(good.reading()->singleturn_valid());
  bench.encoder.raise_alarms(word_error);
  ReadPosition alarmed(format);
  ASSERT_EQ(bench.run(alarmed).error(), Error::none);
  EXPECT_FALSE(alarmed.reading()->singleturn_valid());
  EXPECT_EQ(alarmed.reading()->alarms, word_error);
}

// ---- The virtual encoder with raw clocks

TEST(SsiDevice, SendsBitsOfAfterWord) {
  for (const auto& [after, wanted] :
       std::to_array<std::pair<AfterWord, std::string_view>>({{AfterWord::repeat, "0001111011110001"},
                                                              {AfterWord::zero, "0001111011110000"},
                                                              {AfterWord::one, "0001111011111111"},
                                                              {AfterWord::separated, "0001111011110000"}})) {
    Bench bench({.after_word = after});
    EXPECT_EQ(bench.clock(16), wanted);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

TEST(SsiDevice, ContinuesOldWordWithinPause) {
  Bench bench({.pause = 500us, .monoflop = Time{}});
  EXPECT_EQ(bench.clock(12), "000111101111");
  bench.shaft.state.position = 0;
  EXPECT_EQ(bench.clock(4, 499us), "0001");
  EXPECT_EQ(bench.last_rule(), "clocked again within monoflop_us");
  EXPECT_EQ(bench.clock(12, 100us), "111011110001");
  bench.shaft.state.position = std::int64_t{1} << 20;
  EXPECT_EQ(bench.clock(12, 500us), "000000000001");
  EXPECT_EQ(bench.encoder.violation_count(), 2u);
}

TEST(SsiDevice, ReportsTooFewClocksAndWrongRate) {
  Bench bench;
  EXPECT_EQ(bench.clock(8).size(), 8u);
  EXPECT_EQ(bench.last_rule(), "fewer clocks than the word has bits");
  Bench quick({.slowest_khz = 500, .fastest_khz = 1000});
  for (const auto& [tried, allowed] :
       {std::pair(&bench, std::pair(100'000u, 250'000u)), {&quick, {500'000, 1'000'000}}}) {
    const std::uint32_t before = tried->encoder.violation_count();
    tried->clock(12, 1ms, allowed.first);
    tried->clock(12, 1ms, allowed.second);
    EXPECT_EQ(tried->encoder.violation_count(), before);
    tried->clock(12, 1ms, allowed.first - 10'000);
    EXPECT_EQ(tried->last_rule(), "clock outside min_clock_khz to max_clock_khz");
    tried->clock(12, 1ms, allowed.second + 50'000);
    EXPECT_EQ(tried->encoder.violation_count(), before + 2);
  }
}

}  // namespace
}  // namespace absenc::ssi
