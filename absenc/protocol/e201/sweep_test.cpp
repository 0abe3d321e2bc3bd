// SPDX-License-Identifier: Apache-2.0
// Tests of clock-sweep.
#include <gtest/gtest.h>

#include "absenc/protocol/e201/bench_test.hpp"
#include "absenc/protocol/e201/procedures.hpp"

namespace absenc::e201 {
namespace {

using testing::Bench;
using testing::CommandResult;
using testing::Fields;
using testing::RunResult;
using testing::says;
using testing::Tamper;
using testing::TextReply;

// Besides the other bits of a frame, the 64 samples have room for 20 bits of ACK, so clocks 8 (45 bits of ACK) and 7
// (22) are too fast.
TEST(E201Sweep, CountsRecommendsAndRestores) {
  Bench bench("singleturn_bits=32");
  bench.raw("M7\r");
  std::vector<Fields> progress;
  const CommandResult sweep =
      bench.run("clock-sweep", {5}, [&progress](const Conversation<std::uint8_t>& conversation) {
        RunResult now;
        now.take(conversation);
        progress.push_back(now.numbers);
      });
  EXPECT_EQ(sweep.error, "none") << sweep.detail;
  EXPECT_EQ(sweep.fields, (Fields{{"frames", 5},
                                  {"valid_35_khz", 5},
                                  {"valid_70_khz", 5},
                                  {"valid_140_khz", 5},
                                  {"valid_280_khz", 5},
                                  {"valid_560_khz", 5},
                                  {"valid_1100_khz", 5},
                                  {"valid_2200_khz", 0},
                                  {"valid_4400_khz", 0},
                                  {"recommended_clock", 4},
                                  {"recommended_khz", 280},
                                  {"restored_clock", 7},
                                  {"aborted", 0}}));
  EXPECT_EQ(bench.raw("m"), "7\r");
  ASSERT_EQ(progress.size(), 8u);
  EXPECT_EQ(progress[0], (Fields{{"frames", 5}, {"valid_35_khz", 5}}));
}

TEST(E201Sweep, LineDelayMovesTheRecommendation) {
  // The line's delay of 905 ns is about a whole number of clock periods at 1100, 2200 and 4400 kHz, so the interface
  // samples bits there while they change.
  Bench bench("singleturn_bits=19 latency_us=0 line_delay_ns=905");
  const Fields fields = bench.run("clock-sweep", {20}).fields;
  EXPECT_LT(fields.at("valid_1100_khz"), 20);
  EXPECT_EQ(fields.at("valid_560_khz"), 20);
  EXPECT_EQ(fields.at("valid_2200_khz"), 0);
  EXPECT_EQ(fields.at("recommended_clock"), 3);
}

TEST(E201Sweep, RecommendsMiddleOfLongestRun) {
  for (const auto& [good, recommended] : std::to_array<std::pair<std::string_view, unsigned>>(
           {{"11111111", 5}, {"10111011", 4}, {"11000110", 2}, {"00000001", 8}, {"01000011", 8}, {"00000000", 0}})) {
    InterfaceResults sweep{.frames = 3};
    for (unsigned i = 0; i < good.size(); ++i) sweep.valid[i] = good[i] == '1' ? 3 : 2;
    EXPECT_EQ(sweep.recommended(), recommended) << good;
  }
}

TEST(E201Sweep, AbortRestoresTheClockAtAnyStep) {
  for (unsigned steps = 0; steps < 400; steps += 3) {
    Bench bench;
    bench.raw("M6\r");
    const author::testing::Talk<std::uint8_t> talk(unit, bench.options, "clock-sweep", {100});
    Conversation<std::uint8_t>& sweep = *talk;
    const std::size_t host = bench.line.attach(sim::NodeRole::host, sweep);
    for (unsigned i = 0; i < steps && !bench.line.done(host); ++i) bench.line.step();
    const Time asked = bench.line.now();
    EXPECT_TRUE(sweep.abort());
    ASSERT_TRUE(bench.line.run(host, asked + 1s));
    EXPECT_LT(bench.line.now() - asked, 30ms) << steps;
    EXPECT_EQ(sweep.error(), Error::none);
    EXPECT_TRUE(steps != 0 || bench.answering.asked() == "MvmMm") << bench.answering.asked();
    EXPECT_EQ(bench.raw("m"), "6\r") << steps;
    RunResult told;
    told.take(sweep);
    EXPECT_EQ(told.numbers["aborted"], 1);
    EXPECT_EQ(told.numbers["restored_clock"], 6);
    EXPECT_FALSE(told.numbers.contains("recommended_clock"));
  }
}

// Checks that an aborted sweep reports the results so far, and recommends no clock.
TEST(E201Sweep, RecommendsNothingAfterAbort) {
  Bench bench;
  unsigned emits = 0;
  const CommandResult sweep = bench.run("clock-sweep", {2}, [&](Conversation<std::uint8_t>& conversation) {
    if (++emits == 3) conversation.abort();
  });
  EXPECT_EQ(sweep.fields, (Fields{{"frames", 2},
                                  {"valid_35_khz", 2},
                                  {"valid_70_khz", 2},
                                  {"valid_140_khz", 2},
                                  {"restored_clock", 4},
                                  {"aborted", 1}}));
}

TEST(E201Sweep, ReportLeftNamesClockThatWasSetLast) {
  Bench bench;
  bench.raw("M6\r");
  const author::testing::Talk<std::uint8_t> talk(unit, bench.options, "clock-sweep", {3});
  Conversation<std::uint8_t>& sweep = *talk;
  const std::size_t host = bench.line.attach(sim::NodeRole::host, sweep);
  std::string left;
  while (!bench.line.done(host)) {
    bench.line.step();
    RunResult told;
    sweep.report_left(told);
    if (told.numbers.empty()) {
      EXPECT_FALSE(says(bench.answering.asked(), "M6M")) << "another clock is set";
      continue;
    }
    EXPECT_EQ(told.numbers["previous_clock"], 6);
    const auto clock = static_cast<char>('0' + told.numbers["left_clock"]);
    EXPECT_EQ(told.numbers["left_khz"], clocks_khz[static_cast<std::size_t>(clock - '1')]);
    if (left.empty() || left.back() != clock) left += clock;
  }
  EXPECT_EQ(left, "123456786");
}

TEST(E201Sweep, ReportsEachErrorAndRestoresClock) {
  struct Case {
    // letter of the command whose request number `nth` gets the reply `answer`; if `always`, every later request of
    // this command gets it, too
    char letter;
    int nth;
    bool always;
    std::vector<TextReply> answer;
    std::string error;
    std::string detail;
    std::string advice;
    bool restored;
  };
  const std::vector<TextReply> short_stream(11, {"1", 10ms});
  for (const Case& one : std::vector<Case>{
           {'v', 1, false, {{"V1.15\r"}}, "unsupported", "1.16", "`absenc info`", true},
           {'m', 1, false, {{"?\r"}}, "bad_framing", "does not say which clock", "E201-9S", true},
           {'m', 4, false, {{"8\r"}}, "cross_check_failed", "another clock than", "", true},
           {'m', 4, false, {}, "timeout", "is silent", "it is an E201-9S", true},
           {'m', 4, false, {{"8"}}, "wrong_length", "ends with CR", "stream-off", true},
           {'4', 5, false, short_stream, "wrong_length", "without a pause", "stream-off", true},
           {'4', 1, true, {{"0000000000000000\r"}}, "line_stuck", "no MA clock", "supply-on", true},
           {'4', 1, true, {}, "timeout", "no MA clock", "check supply", true},
           {'M', 9, false, {}, "cross_check_failed", "could not be restored", "`absenc config set ... clock`", false},
           {'m', 10, false, {}, "timeout", "not known whether", "`absenc config set ... clock`", true}}) {
    Bench bench;
    int asked = 0;
    const Tamper tamper = [&](char letter) {
      if (letter == one.letter) ++asked;
      const bool answers = letter == one.letter && (asked == one.nth || (one.always && asked > one.nth));
      return answers ? std::optional(one.answer) : std::nullopt;
    };
    const CommandResult sweep = bench.run_tampered(tamper, "clock-sweep", {2});
    EXPECT_EQ(sweep.error, one.error) << one.detail;
    EXPECT_TRUE(says(sweep.detail, one.detail)) << sweep.detail;
    EXPECT_TRUE(says(sweep.advice, one.advice)) << sweep.advice;
    EXPECT_TRUE(sweep.fields.empty());
    EXPECT_EQ(bench.raw("m") == "4\r", one.restored) << one.detail;
  }
}

// Checks that a single invalid frame is counted, and is no error of the sweep.
TEST(E201Sweep, ContinuesAfterBadFrame) {
  Bench bench;
  int asked = 0;
  const Tamper tamper = [&](char letter) {
    return letter == '4' && ++asked == 1 ? std::optional(std::vector<TextReply>{{"1\r"}}) : std::nullopt;
  };
  const CommandResult sweep = bench.run_tampered(tamper, "clock-sweep", {2});
  EXPECT_EQ(sweep.error, "none");
  EXPECT_EQ(sweep.fields.at("valid_35_khz"), 1);
  EXPECT_EQ(sweep.fields.at("valid_70_khz"), 2);
}

}  // namespace
}  // namespace absenc::e201
