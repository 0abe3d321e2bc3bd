// SPDX-License-Identifier: Apache-2.0
// The unit's commands against the virtual E201-9S, and against interfaces that answer otherwise.
#include <gtest/gtest.h>

#include "absenc/protocol/e201/bench_test.hpp"
#include "absenc/protocol/e201/procedures.hpp"

namespace absenc::e201 {
namespace {

using testing::answering;
using testing::Bench;
using testing::Ended;
using testing::Fields;
using testing::Said;
using testing::Tamper;

constexpr std::int64_t turn = std::int64_t{1} << 32;
constexpr std::int64_t count = std::int64_t{1} << 13;  // of 19 bits

bool says(const std::string& text, const std::string& words) { return text.find(words) != std::string::npos; }

TEST(E201Read, APosition) {
  Bench bench;
  bench.shaft.state.position = turn + 275096 * count;
  const Ended read = bench.run("position");
  EXPECT_EQ(read.error, "none");
  EXPECT_EQ(read.fields, (Fields{{"ack_bits", 3},
                                 {"multiturn", 1},
                                 {"singleturn", 275096},
                                 {"angle_deg", 188},
                                 {"error", 0},
                                 {"warning", 0},
                                 {"crc", 0x1C}}));
  ASSERT_TRUE(read.reading && read.reading->singleturn_valid());
  EXPECT_EQ(read.reading->latched, line_settings.bits(10));
  EXPECT_EQ(read.reading->received, read.took);
  EXPECT_EQ(bench.device.violation_count(), 0u);
}

TEST(E201Read, AnSsiEncoder) {
  Bench bench("carries=ssi singleturn_bits=13 multiturn_bits=12 gray=true");
  bench.shaft.state.position = 7 * turn + (std::int64_t{0x1234} << 19);
  const Ended read = bench.run("position");
  EXPECT_EQ(read.fields, (Fields{{"multiturn", 7}, {"singleturn", 0x1234}, {"angle_deg", 204}}));
}

TEST(E201Read, ALinearEncoder) {
  Bench bench("position_bits=32 unit_um=0.05");
  bench.shaft.state.position = 1'579'271;
  const Ended read = bench.run("position");
  ASSERT_TRUE(read.reading);
  EXPECT_EQ(read.reading->unit_um, 0.05);
  EXPECT_EQ(read.fields.at("position_um"), 78'963);
  EXPECT_EQ(unit.resolution(bench.options).unit_um, 0.05);
}

TEST(E201Read, OptionsThatContradictIt) {
  std::vector<std::byte> storage(unit.host_storage);
  std::vector<std::byte> device_storage(unit.device_storage);
  const testing::TestShaft shaft;
  const auto made = [&](std::string_view settings, std::string_view command) {
    const std::array<std::int64_t, 1> arguments{20};
    return unit.host(testing::options_of(settings), *find_command(unit, command), arguments, storage).bytes != nullptr;
  };
  for (const auto& [settings, readable, usable] :
       std::vector<std::tuple<std::string_view, bool, bool>>{{"position_bits=51 unit_um=1", true, true},
                                                             {"position_bits=51", false, true},
                                                             {"position_bits=52 unit_um=1", false, false}}) {
    EXPECT_EQ(made(settings, "position"), readable) << settings;
    EXPECT_EQ(made(settings, "clock-sweep"), readable);
    EXPECT_TRUE(made(settings, "info"));
    EXPECT_FALSE(made(settings, "set-clock"));  // 20 is none
    EXPECT_EQ(unit.device(testing::options_of(settings), shaft, device_storage).bytes != nullptr, usable);
  }
}

TEST(E201Read, AlarmsOfTheEncoder) {
  Bench bench;
  bench.device.raise_alarms(word_error);
  const Ended read = bench.run("position");
  ASSERT_TRUE(read.reading);
  EXPECT_EQ(read.reading->alarms, word_error);
  EXPECT_FALSE(read.reading->singleturn_valid());
}

struct Failure {
  Tamper tamper;
  std::string asked;
  std::string error;
  std::string detail;
  std::string advice;
};

TEST(E201Read, WhatFails) {
  Bench bench("singleturn_bits=19");
  const auto replies = [](std::vector<Said> samples, std::vector<Said> version) -> Tamper {
    return [=](char asked) { return std::optional(asked == '4' ? samples : version); };
  };
  const std::vector<Said> v116{{"E201-9S V1.16\r"}};
  const std::vector<Said> garbage{{"c0014328ff300000"}};
  for (const Failure& one : std::vector<Failure>{
           {replies({{"c0014328fe300000\r"}}, v116), "4", "bad_checksum", "delay of the line", "another MA clock"},
           {replies({{"0000000000000000\r"}}, v116), "4", "line_stuck", "", "supply-on"},
           {replies({{"c0014328ff30000g\r"}}, v116), "4", "bad_framing", "hexadecimal digits", "E201-9S"},
           {replies(garbage, v116), "4v4", "wrong_length", "16 hexadecimal digits and CR", "stream-off"},
           {replies(garbage, {{"1.15\r"}}), "4v", "unsupported", "1.16", "`info`"},
           {replies(garbage, {}), "4v4", "wrong_length", "16 hexadecimal digits and CR", "stream-off"},
           {replies({}, v116), "4v4", "timeout", "answers `v` but not `4`", "`info`"},
           {replies({}, {}), "4v", "timeout", "is silent", "it is an E201-9S"},
           {replies({}, {{"V"}}), "4v", "wrong_length", "a line that ends with CR", "stream-off"}}) {
    const Ended read = bench.run_tampered(one.tamper, "position");
    EXPECT_EQ(read.error, one.error);
    EXPECT_TRUE(says(read.detail, one.detail)) << read.detail;
    EXPECT_TRUE(says(read.advice, one.advice)) << read.advice;
    EXPECT_EQ(bench.tampered.asked(), one.asked);
    EXPECT_FALSE(read.reading);
    EXPECT_TRUE(read.fields.empty());
  }
  // The second `4` may be answered.
  int asked = 0;
  const Tamper once = [&](char letter) {
    return letter == '4' && ++asked == 1 ? std::optional(garbage) : std::nullopt;
  };
  EXPECT_EQ(bench.run_tampered(once, "position").error, "none");
}

// No document gives these times: what is slower is no reply, and nothing waits for longer.
TEST(E201Read, ItsTimes) {
  Bench bench("singleturn_bits=19");
  const std::string good = "c0014328ff300000\r";
  const auto late = [&](Time after) { return bench.run_tampered(answering('4', {{good, after}}), "position"); };
  const auto broken = [&](Time gap) {
    return bench.run_tampered(answering('4', {{good.substr(0, 9)}, {good.substr(9), gap}}), "position");
  };
  EXPECT_EQ(late(48ms).error, "none");
  EXPECT_NE(late(52ms).error, "none");
  EXPECT_EQ(broken(18ms).error, "none");
  EXPECT_NE(broken(22ms).error, "none");
  const std::vector<Said> stream(40, {"17\r", 10ms});
  const Ended noisy = bench.run_tampered(answering('4', stream), "position");
  EXPECT_EQ(noisy.error, "wrong_length");
  EXPECT_TRUE(says(noisy.detail, "without a pause")) << noisy.detail;
  EXPECT_TRUE(says(noisy.advice, "stream-off")) << noisy.advice;
  EXPECT_GT(noisy.took, 100ms);
  EXPECT_LT(noisy.took, 130ms);
  EXPECT_EQ(bench.tampered.asked(), "4");  // asking more would not help
}

TEST(E201Info, KeepsWhatItCannotRead) {
  Bench bench;
  EXPECT_EQ(bench.run("info").fields, (Fields{{"version", 0},
                                              {"serial", 0},
                                              {"supply", 0},
                                              {"supply_mv", 4980},
                                              {"supply_ma", 62},
                                              {"clock", 4},
                                              {"clock_khz", 280}}));
  const Ended partly = bench.run_tampered(answering('e', {{"none\r"}}), "info");
  EXPECT_EQ(partly.fields, (Fields{{"version", 0}, {"serial", 0}, {"supply", 0}, {"clock", 4}, {"clock_khz", 280}}));
  EXPECT_EQ(bench.run_tampered(answering('e', {}), "info").fields,
            (Fields{{"version", 0}, {"serial", 0}, {"clock", 4}, {"clock_khz", 280}}));
  EXPECT_EQ(bench.run_tampered(answering('v', {}), "info").error, "timeout");
  const Tamper stream = answering('s', std::vector<Said>(40, {"1", 10ms}));
  EXPECT_EQ(bench.run_tampered(stream, "info").error, "wrong_length");
  EXPECT_EQ(bench.tampered.asked(), "vs");
}

TEST(E201Set, IsReadBack) {
  Bench bench;
  EXPECT_EQ(bench.run("set-clock", {1100}).fields, (Fields{{"clock", 6}, {"clock_khz", 1100}}));
  EXPECT_EQ(bench.run("clock").fields, (Fields{{"clock", 6}, {"clock_khz", 1100}}));
  EXPECT_EQ(bench.run("width").fields, (Fields{{"width", 35}}));
  const Ended refused = bench.run_tampered(answering('M', {}), "set-clock", {2});
  EXPECT_EQ(refused.error, "cross_check_failed");
  EXPECT_TRUE(says(refused.detail, "another setting")) << refused.detail;
  EXPECT_EQ(bench.raw("M2\rm"), "2\r");
  // A reply that nobody describes does not disturb it, but one that does not end.
  EXPECT_EQ(bench.run_tampered(answering('M', {{"M2 ok\r\n"}, {"more", 15ms}}), "set-clock", {2}).error, "none");
  const Tamper stream = answering('M', std::vector<Said>(40, {"1", 10ms}));
  EXPECT_EQ(bench.run_tampered(stream, "set-clock", {2}).error, "wrong_length");
  EXPECT_EQ(bench.tampered.asked(), "M");
  EXPECT_EQ(bench.run_tampered(answering('m', {}), "set-clock", {2}).error, "timeout");
}

// A command that may have no reply is waited for 10 ms.
TEST(E201Set, WaitsForAReplyThatMayNotCome) {
  Bench bench;
  const auto tell = [&](Time after) {
    const Ended told = bench.run_tampered(answering('a', {{"ok\r", after}}), "clear-zero");
    EXPECT_EQ(told.error, "none");
    EXPECT_EQ(told.fields, (Fields{{"command", 0}}));
    return told.took;
  };
  EXPECT_LT(tell(11ms), 11ms);
  EXPECT_GT(tell(9ms), 29ms);
  EXPECT_EQ(bench.run("stream-off").error, "none");
}

TEST(E201Supply, OffIsALineThatIsStuck) {
  Bench bench;
  EXPECT_EQ(bench.run("supply-off").fields, (Fields{{"supply", 0}, {"supply_mv", 20}, {"supply_ma", 0}}));
  EXPECT_EQ(bench.run("position").error, "line_stuck");
  EXPECT_EQ(bench.run("supply-on").fields.at("supply_mv"), 4980);
  EXPECT_EQ(bench.run("position").error, "none");
  for (const auto& [command, text, error] : std::to_array<std::tuple<std::string, std::string, std::string>>(
           {{"supply-on", "1.001V", "none"},
            {"supply-on", "1.0V 0mA", "cross_check_failed"},
            {"supply-off", "1.001V", "cross_check_failed"},
            {"supply-off", "1.0V 0mA", "none"},
            {"supply-off", "whatever", "none"}})) {
    const Ended ended = bench.run_tampered(answering('e', {{text + "\r"}}), command);
    EXPECT_EQ(ended.error, error) << command << text;
    EXPECT_EQ(error != "none", says(ended.detail, "contradicts"));
    ASSERT_EQ(bench.tampered.log.size(), 2u);
    EXPECT_EQ(bench.tampered.log[0].first, command == "supply-on" ? 'n' : 'f');
    const Time pause = bench.tampered.log[1].second - bench.tampered.log[0].second;
    EXPECT_GE(pause, 200ms);
    EXPECT_LT(pause, 201ms);
  }
}

TEST(E201Zero, IsReadBack) {
  Bench bench;
  bench.shaft.state.position = 275096 * count;
  EXPECT_EQ(bench.run("set-zero").fields, (Fields{{"counts", 0}}));
  bench.shaft.state.position -= 10 * count;
  EXPECT_EQ(bench.run("decimal").fields, (Fields{{"counts", -10}}));
  EXPECT_EQ(bench.run("position").fields.at("singleturn"), 275086);  // the encoder's own position
  EXPECT_EQ(bench.run("clear-zero").error, "none");
  EXPECT_EQ(bench.run("decimal").fields, (Fields{{"counts", 275086}}));
}

// 0.02 degrees are 29 counts of 19 bits, and 1 of 12.
TEST(E201Zero, NeedsAnEncoderThatStandsStill) {
  struct Case {
    std::string bits;
    std::vector<std::string> looks;
    std::string error;
  };
  for (const Case& one : std::vector<Case>{{"19", {"100", "129", "29"}, "none"},
                                           {"19", {"129", "100", "-29"}, "none"},
                                           {"19", {"100", "130"}, "invalid_argument"},
                                           {"19", {"130", "100"}, "invalid_argument"},
                                           {"19", {"100", "524388"}, "invalid_argument"},  // a turn
                                           {"19", {"100", "100", "30"}, "cross_check_failed"},
                                           {"19", {"100", "100", "524288"}, "cross_check_failed"},
                                           {"12", {"-1", "0", "1"}, "none"},
                                           {"12", {"100", "102"}, "invalid_argument"},
                                           {"19", {"-9223372036854775808", "9223372036854775807"}, "invalid_argument"},
                                           {"19", {"1f"}, "bad_framing"}}) {
    Bench bench("singleturn_bits=" + one.bits);
    std::size_t look = 0;
    const Tamper tamper = [&](char letter) {
      const bool answers = letter == '?' && look < one.looks.size();
      return answers ? std::optional(std::vector<Said>{{one.looks[look++] + "\r"}}) : std::nullopt;
    };
    const Ended zero = bench.run_tampered(tamper, "set-zero");
    EXPECT_EQ(zero.error, one.error) << one.looks.back();
    const std::array asked{"", "?", "??", "??z?"};
    EXPECT_EQ(bench.tampered.asked(), asked[one.looks.size()]);
    if (one.looks.size() < 2) continue;
    const Time pause = bench.tampered.log[1].second - bench.tampered.log[0].second;
    EXPECT_GE(pause, 10ms);
    EXPECT_LT(pause, 14ms);
  }
}

// ---- clock-sweep

/// 10 us of latency, 32 + 8 bits: up to 20 bits of ACK fit, so M8 (45 bits) and M7 (22) are too fast.
TEST(E201Sweep, CountsRecommendsAndRestores) {
  Bench bench("singleturn_bits=32");
  bench.raw("M7");
  std::vector<Fields> progress;
  const Ended sweep = bench.run("clock-sweep", {5}, [&progress](const Conversation<std::uint8_t>& conversation) {
    testing::Collector collector;
    conversation.report(collector);
    progress.push_back(collector.fields);
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
  // Two bits late at 4400 kHz, one at 2200, and 900 ns are the period at 1100: nothing fast is stable.
  Bench bench("singleturn_bits=19 latency_us=0 line_delay_ns=905");
  const Fields fields = bench.run("clock-sweep", {20}).fields;
  EXPECT_LT(fields.at("valid_1100_khz"), 20);
  EXPECT_EQ(fields.at("valid_560_khz"), 20);
  EXPECT_EQ(fields.at("valid_2200_khz"), 0);
  EXPECT_EQ(fields.at("recommended_clock"), 3);
}

TEST(E201Sweep, TheLongestRunIsRecommended) {
  for (const auto& [good, recommended] : std::to_array<std::pair<std::string_view, unsigned>>(
           {{"11111111", 5}, {"10111011", 4}, {"11000110", 2}, {"00000001", 8}, {"01000011", 8}, {"00000000", 0}})) {
    Sweep sweep{.frames = 3};
    for (unsigned i = 0; i < good.size(); ++i) sweep.valid[i] = good[i] == '1' ? 3 : 2;
    EXPECT_EQ(sweep.recommended(), recommended) << good;
  }
}

TEST(E201Sweep, AbortRestoresTheClockAtAnyStep) {
  for (unsigned steps = 0; steps < 400; steps += 3) {
    Bench bench;
    bench.raw("M6");
    Conversation<std::uint8_t>& sweep = bench.make("clock-sweep", {100});
    const std::size_t host = bench.line.attach(sim::Role::host, sweep);
    for (unsigned i = 0; i < steps && !bench.line.done(host); ++i) bench.line.step();
    const Time asked = bench.line.now();
    EXPECT_TRUE(sweep.abort());
    ASSERT_TRUE(bench.line.run(host, asked + 1s));
    EXPECT_LT(bench.line.now() - asked, 30ms) << steps;
    EXPECT_EQ(sweep.error(), Error::none);
    EXPECT_EQ(bench.raw("m"), "6\r") << steps;
    testing::Collector collector;
    sweep.report(collector);
    EXPECT_EQ(collector.fields["aborted"], 1);
    EXPECT_EQ(collector.fields["restored_clock"], 6);
    EXPECT_FALSE(collector.fields.contains("recommended_clock"));
  }
}

TEST(E201Sweep, WhatIsLeftIsTheClockThatWasSetLast) {
  Bench bench;
  bench.raw("M6");
  Conversation<std::uint8_t>& sweep = bench.make("clock-sweep", {3});
  const std::size_t host = bench.line.attach(sim::Role::host, sweep);
  std::string left;
  while (!bench.line.done(host)) {
    bench.line.step();
    testing::Collector collector;
    sweep.report_left(collector);
    if (collector.fields.empty()) {
      EXPECT_FALSE(says(bench.tampered.asked(), "M6M")) << "another clock is set";
      continue;
    }
    EXPECT_EQ(collector.fields["previous_clock"], 6);
    const auto clock = static_cast<char>('0' + collector.fields["left_clock"]);
    EXPECT_EQ(collector.fields["left_khz"], clocks_khz[static_cast<std::size_t>(clock - '1')]);
    if (left.empty() || left.back() != clock) left += clock;
  }
  EXPECT_EQ(left, "123456786");
}

TEST(E201Sweep, WhatFails) {
  struct Case {
    char letter;  // this command is answered so, the `nth` time and, when `always`, ever after
    int nth;
    bool always;
    std::vector<Said> answer;
    std::string error;
    std::string detail;
    std::string advice;
    bool restored;
  };
  const std::vector<Said> short_stream(11, {"1", 10ms});
  for (const Case& one : std::vector<Case>{
           {'v', 1, false, {{"V1.15\r"}}, "unsupported", "1.16", "`info`", true},
           {'m', 1, false, {{"?\r"}}, "bad_framing", "does not say which clock", "E201-9S", true},
           {'m', 4, false, {{"8\r"}}, "cross_check_failed", "another clock than", "", true},
           {'m', 4, false, {}, "timeout", "is silent", "it is an E201-9S", true},
           {'m', 4, false, {{"8"}}, "wrong_length", "ends with CR", "stream-off", true},
           {'4', 5, false, short_stream, "wrong_length", "without a pause", "stream-off", true},
           {'4', 1, true, {{"0000000000000000\r"}}, "line_stuck", "no MA clock", "supply-on", true},
           {'4', 1, true, {}, "timeout", "no MA clock", "", true},
           {'M', 9, false, {}, "cross_check_failed", "could not be restored", "with clock and set-clock", false},
           {'m', 10, false, {}, "timeout", "not known whether", "with clock and set-clock", true}}) {
    Bench bench;
    int asked = 0;
    const Tamper tamper = [&](char letter) {
      if (letter == one.letter) ++asked;
      const bool answers = letter == one.letter && (asked == one.nth || (one.always && asked > one.nth));
      return answers ? std::optional(one.answer) : std::nullopt;
    };
    const Ended sweep = bench.run_tampered(tamper, "clock-sweep", {2});
    EXPECT_EQ(sweep.error, one.error) << one.detail;
    EXPECT_TRUE(says(sweep.detail, one.detail)) << sweep.detail;
    EXPECT_TRUE(says(sweep.advice, one.advice)) << sweep.advice;
    EXPECT_TRUE(sweep.fields.empty());
    EXPECT_EQ(bench.raw("m") == "4\r", one.restored) << one.detail;
  }
}

// Some bad frames are what a sweep is for.
TEST(E201Sweep, GoesOnAfterABadFrame) {
  Bench bench;
  int asked = 0;
  const Tamper tamper = [&](char letter) {
    return letter == '4' && ++asked == 1 ? std::optional(std::vector<Said>{{"1\r"}}) : std::nullopt;
  };
  const Ended sweep = bench.run_tampered(tamper, "clock-sweep", {2});
  EXPECT_EQ(sweep.error, "none");
  EXPECT_EQ(sweep.fields.at("valid_35_khz"), 1);
  EXPECT_EQ(sweep.fields.at("valid_70_khz"), 2);
}

}  // namespace
}  // namespace absenc::e201
