// SPDX-License-Identifier: Apache-2.0
// Tests of the unit's commands with the virtual E201-9S and with other replies.
#include <gtest/gtest.h>

#include "absenc/protocol/e201/bench_test.hpp"

namespace absenc::e201 {
namespace {

using testing::answering;
using testing::Bench;
using testing::CommandResult;
using testing::count;
using testing::Fields;
using testing::says;
using testing::Tamper;
using testing::TextReply;
using testing::turn;

TEST(E201Read, ReadsBissPosition) {
  Bench bench;
  bench.shaft.start.position = turn + 275096 * count;
  const CommandResult read = bench.run("position");
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

TEST(E201Read, ReadsSsiPosition) {
  Bench bench("carries=ssi singleturn_bits=13 multiturn_bits=12 gray=true");
  bench.shaft.start.position = 7 * turn + (std::int64_t{0x1234} << 19);
  const CommandResult read = bench.run("position");
  EXPECT_EQ(read.fields, (Fields{{"multiturn", 7}, {"singleturn", 0x1234}, {"angle_deg", 204}}));
}

TEST(E201Read, RefusesContradictingOptions) {
  std::vector<std::byte> storage(unit.host_storage);
  std::vector<std::byte> device_storage(unit.device_storage);
  const sim::testing::TestShaft<19> shaft;
  const auto made = [&](std::string_view settings, std::string_view command) {
    const Command& info = *find_command(unit, command);
    const std::vector<std::int64_t> arguments(info.arguments.size(), 20);
    const auto* const host = unit.host(author::testing::options_of(unit, settings), info, arguments, storage).bytes;
    return host != nullptr && host->error() != Error::invalid_argument;
  };
  for (const auto& [settings, readable, usable] :
       std::vector<std::tuple<std::string_view, bool, bool>>{{"position_bits=51 unit_um=1", true, true},
                                                             {"position_bits=51", false, true},
                                                             {"position_bits=52 unit_um=1", false, false}}) {
    EXPECT_EQ(made(settings, "position"), readable) << settings;
    EXPECT_EQ(made(settings, "clock-sweep"), readable);
    EXPECT_TRUE(made(settings, "info"));
    // the argument of set-clock, 20, is neither the number of a clock nor a frequency
    EXPECT_FALSE(made(settings, "set-clock"));
    EXPECT_EQ(unit.device(author::testing::options_of(unit, settings), shaft, device_storage).bytes != nullptr, usable);
  }
}

struct Failure {
  Tamper tamper;
  std::string asked;
  std::string error;
  std::string detail;
  std::string advice;
};

TEST(E201Read, ExplainsEachError) {
  Bench bench("singleturn_bits=19");
  const auto replies = [](std::vector<TextReply> samples, std::vector<TextReply> version) -> Tamper {
    return [=](char asked) { return std::optional(asked == '4' ? samples : version); };
  };
  const std::vector<TextReply> v116{{"E201-9S V1.16\r"}};
  const std::vector<TextReply> garbage{{"c0014328ff300000"}};
  for (const Failure& one : std::vector<Failure>{
           {replies({{"c0014328fe300000\r"}}, v116), "4", "bad_checksum", "delay of the line", "another MA clock"},
           {replies({{"0000000000000000\r"}}, v116), "4", "line_stuck", "", "supply-on"},
           {replies({{"c0014328ff30000g\r"}}, v116), "4", "bad_framing", "hexadecimal digits", "E201-9S"},
           {replies(garbage, v116), "4v4", "wrong_length", "16 hexadecimal digits and CR", "stream-off"},
           {replies(garbage, {{"1.15\r"}}), "4v", "unsupported", "1.16", "`absenc info`"},
           {replies(garbage, {}), "4v4", "wrong_length", "16 hexadecimal digits and CR", "stream-off"},
           {replies({}, v116), "4v4", "timeout", "answers `v` but not `4`", "`absenc info`"},
           {replies({}, {}), "4v", "timeout", "is silent", "it is an E201-9S"},
           {replies({}, {{"V"}}), "4v", "wrong_length", "a line that ends with CR", "stream-off"}}) {
    const CommandResult read = bench.run_tampered(one.tamper, "position");
    EXPECT_EQ(read.error, one.error);
    EXPECT_TRUE(says(read.detail, one.detail)) << read.detail;
    EXPECT_TRUE(says(read.advice, one.advice)) << read.advice;
    EXPECT_EQ(bench.answering.asked(), one.asked);
    EXPECT_FALSE(read.reading);
    EXPECT_TRUE(read.fields.empty());
  }
  // The first `4` gets an invalid reply, the second one a valid reply.
  int asked = 0;
  const Tamper once = [&](char letter) {
    return letter == '4' && ++asked == 1 ? std::optional(garbage) : std::nullopt;
  };
  EXPECT_EQ(bench.run_tampered(once, "position").error, "none");
}

// The timeouts of a reply are assumed, because no document states any.
TEST(E201Read, UsesReplyTimeouts) {
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
  const std::vector<TextReply> stream(40, {"17\r", 10ms});
  const CommandResult noisy = bench.run_tampered(answering('4', stream), "position");
  EXPECT_EQ(noisy.error, "wrong_length");
  EXPECT_TRUE(says(noisy.detail, "without a pause")) << noisy.detail;
  EXPECT_TRUE(says(noisy.advice, "stream-off")) << noisy.advice;
  EXPECT_GT(noisy.took, 100ms);
  EXPECT_LT(noisy.took, 130ms);
  EXPECT_EQ(bench.answering.asked(), "4");  // the host sends no further request on a line that is never silent
}

TEST(E201Info, ReportsTextsWithoutNumbers) {
  Bench bench;
  EXPECT_EQ(bench.run("info").fields, (Fields{{"version", 0},
                                              {"serial", 0},
                                              {"supply", 0},
                                              {"supply_mv", 4980},
                                              {"supply_ma", 62},
                                              {"clock", 4},
                                              {"clock_khz", 280}}));
  const CommandResult partly = bench.run_tampered(answering('e', {{"none\r"}}), "info");
  EXPECT_EQ(partly.fields, (Fields{{"version", 0}, {"serial", 0}, {"supply", 0}, {"clock", 4}, {"clock_khz", 280}}));
  EXPECT_EQ(bench.run_tampered(answering('e', {}), "info").fields,
            (Fields{{"version", 0}, {"serial", 0}, {"clock", 4}, {"clock_khz", 280}}));
  // A repeated reply must not be taken for the reply to the next command.
  EXPECT_EQ(bench.run_tampered(answering('v', {{"E201-9S V1.16\r"}, {"E201-9S V1.16\r"}}), "info").error,
            "wrong_length");
  EXPECT_EQ(
      bench.run_tampered(answering('s', {{"09S0417\r"}, {"09S0417\r", 18ms}}), "info").fields,
      (Fields{
          {"version", 0}, {"supply", 0}, {"supply_mv", 4980}, {"supply_ma", 62}, {"clock", 4}, {"clock_khz", 280}}));
  EXPECT_EQ(bench.run_tampered(answering('e', {{"4.98V 62mA\r"}, {"4.98V 62mA\r"}}), "info").fields,
            (Fields{{"version", 0}, {"serial", 0}, {"clock", 4}, {"clock_khz", 280}}));
  EXPECT_EQ(bench.run_tampered(answering('v', {}), "info").error, "timeout");
  const Tamper stream = answering('s', std::vector<TextReply>(40, {"1", 10ms}));
  EXPECT_EQ(bench.run_tampered(stream, "info").error, "wrong_length");
  EXPECT_EQ(bench.answering.asked(), "vs");
}

TEST(E201Set, ReadsClockBack) {
  Bench bench;
  EXPECT_EQ(bench.run("set-clock", {1100}).fields, (Fields{{"clock", 6}, {"clock_khz", 1100}}));
  EXPECT_EQ(bench.run("clock").fields, (Fields{{"clock", 6}, {"clock_khz", 1100}}));
  EXPECT_EQ(bench.run("width").fields, (Fields{{"width", 35}}));
  const CommandResult refused = bench.run_tampered(answering('M', {}), "set-clock", {2});
  EXPECT_EQ(refused.error, "cross_check_failed");
  EXPECT_TRUE(says(refused.detail, "another setting")) << refused.detail;
  EXPECT_EQ(bench.raw("M2\rm"), "2\r");
  // An undocumented reply is ignored, but an undocumented reply that does not end is an error.
  EXPECT_EQ(bench.run_tampered(answering('M', {{"M2 ok\r\n"}, {"more", 15ms}}), "set-clock", {2}).error, "none");
  const Tamper stream = answering('M', std::vector<TextReply>(40, {"1", 10ms}));
  EXPECT_EQ(bench.run_tampered(stream, "set-clock", {2}).error, "wrong_length");
  EXPECT_EQ(bench.answering.asked(), "M");
  EXPECT_EQ(bench.run_tampered(answering('m', {}), "set-clock", {2}).error, "timeout");
}

// The host waits 10 ms for the begin of an optional reply, and 20 ms more for the end of this reply.
TEST(E201Set, WaitsBrieflyForOptionalReply) {
  Bench bench;
  const auto tell = [&](Time after) {
    const CommandResult told = bench.run_tampered(answering('0', {{"ok\r", after}}), "stream-off");
    EXPECT_EQ(told.error, "none");
    EXPECT_EQ(told.fields, (Fields{{"command", 0}}));
    return told.took;
  };
  EXPECT_LT(tell(11ms), 11ms);
  EXPECT_GT(tell(9ms), 29ms);
  EXPECT_EQ(bench.run("stream-off").error, "none");
}

TEST(E201Supply, SupplyOffGivesStuckLineAndIsVerified) {
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
    const CommandResult ended = bench.run_tampered(answering('e', {{text + "\r"}}), command);
    EXPECT_EQ(ended.error, error) << command << text;
    EXPECT_EQ(error != "none", says(ended.detail, "contradicts"));
    ASSERT_EQ(bench.answering.log.size(), 2u);
    EXPECT_EQ(bench.answering.log[0].first, command == "supply-on" ? 'n' : 'f');
    const Time pause = bench.answering.log[1].second - bench.answering.log[0].second;
    EXPECT_GE(pause, 200ms);
    EXPECT_LT(pause, 201ms);
  }
}

TEST(E201Zero, ReadsZeroBack) {
  Bench bench;
  bench.shaft.start.position = 275096 * count;
  EXPECT_EQ(bench.run("set-zero").fields, (Fields{{"counts", 0}}));
  bench.shaft.start.position -= 10 * count;
  EXPECT_EQ(bench.run("decimal").fields, (Fields{{"counts", -10}}));
  // The zero of the interface does not change the position that the command `position` reads.
  EXPECT_EQ(bench.run("position").fields.at("singleturn"), 275086);
  EXPECT_EQ(bench.run("clear-zero").fields, (Fields{{"counts", 275086}}));
  EXPECT_EQ(bench.run("decimal").fields, (Fields{{"counts", 275086}}));
}

// Only the position shows the interface's zero: if it is the same before and after, it proves nothing.
TEST(E201Zero, IsProvenByChangedPositionOnly) {
  struct Case {
    const char* command;
    std::vector<std::string> looks;
    std::string error;
    ChangeSent change;
    const char* note;
  };
  for (const Case& one : std::vector<Case>{
           {"clear-zero", {"0", "0", "275096"}, "none", ChangeSent::yes, ""},
           {"clear-zero", {"275096", "275096", "275096"}, "none", ChangeSent::unproven, "no zero was set, or"},
           {"clear-zero", {"100", "500", "900"}, "none", ChangeSent::unproven, "the shaft turns"},
           {"set-zero", {"100", "100", "0"}, "none", ChangeSent::yes, ""},
           {"set-zero", {"10", "10", "10"}, "none", ChangeSent::unproven, "was zero before"},
           {"set-zero", {"100", "100", "100"}, "cross_check_failed", ChangeSent::refused, ""},
           {"set-zero", {"100", "100", "200"}, "cross_check_failed", ChangeSent::yes, ""}}) {
    Bench bench;
    std::size_t look = 0;
    const Tamper tamper = [&](char letter) {
      const bool answers = letter == '?' && look < one.looks.size();
      return answers ? std::optional(std::vector<TextReply>{{one.looks[look++] + "\r"}}) : std::nullopt;
    };
    const CommandResult ended = bench.run_tampered(tamper, one.command);
    EXPECT_EQ(ended.error, one.error) << one.command << one.looks.back();
    EXPECT_EQ(ended.change, one.change) << one.command << one.looks.back();
    EXPECT_TRUE(says(ended.note, one.note)) << ended.note;
    EXPECT_EQ(ended.note.empty(), one.change != ChangeSent::unproven) << ended.note;
  }
}

// The command set-zero refuses if two positions differ by more than 0.02 degrees (29 counts of 19 bits) and more than
// one count.
TEST(E201Zero, RefusesMovingEncoder) {
  struct Case {
    std::string bits;
    std::vector<std::string> looks;
    std::string error;
  };
  for (const Case& one : std::vector<Case>{{"19", {"100", "129", "29"}, "none"},
                                           {"19", {"129", "100", "-29"}, "none"},
                                           {"19", {"100", "130"}, "not_still"},
                                           {"19", {"130", "100"}, "not_still"},
                                           // the second position is one turn further than the first
                                           {"19", {"100", "524388"}, "not_still"},
                                           {"19", {"100", "100", "30"}, "cross_check_failed"},
                                           {"19", {"100", "100", "524288"}, "cross_check_failed"},
                                           {"12", {"-1", "0", "1"}, "none"},
                                           {"12", {"100", "102"}, "not_still"},
                                           {"19", {"-9223372036854775808", "9223372036854775807"}, "not_still"},
                                           {"19", {"1f"}, "bad_framing"}}) {
    Bench bench("singleturn_bits=" + one.bits);
    std::size_t look = 0;
    const Tamper tamper = [&](char letter) {
      const bool answers = letter == '?' && look < one.looks.size();
      return answers ? std::optional(std::vector<TextReply>{{one.looks[look++] + "\r"}}) : std::nullopt;
    };
    const CommandResult zero = bench.run_tampered(tamper, "set-zero");
    EXPECT_EQ(zero.error, one.error) << one.looks.back();
    const std::array asked{"", "4?", "4??", "4??z?"};  // `4` shows whether the encoder reports an error
    EXPECT_EQ(bench.answering.asked(), asked[one.looks.size()]);
    if (one.looks.size() < 2) continue;
    const Time pause = bench.answering.log[2].second - bench.answering.log[1].second;
    EXPECT_GE(pause, 10ms);
    EXPECT_LT(pause, 14ms);
  }
}

// `?` does not report the encoder's error bit, so `4` is read before.
TEST(E201Zero, RefusesInvalidPosition) {
  Bench bench;
  bench.device.raise_alarms(word_error);
  const CommandResult zero = bench.run("set-zero");
  EXPECT_EQ(zero.error, "invalid_argument");
  EXPECT_TRUE(says(zero.detail, "does not hold")) << zero.detail;
  EXPECT_EQ(bench.answering.asked(), "4");
}

// Firmware before 1.16 does not answer the command `4`; the host must set the zero nevertheless.
TEST(E201Zero, RefusesEncoderWithoutValidWord) {
  Bench bench;
  const CommandResult stuck = bench.run_tampered(answering('4', {{"0000000000000000\r"}}), "set-zero");
  EXPECT_EQ(stuck.error, "line_stuck");
  EXPECT_TRUE(says(stuck.detail, "nothing was changed")) << stuck.detail;
  EXPECT_EQ(bench.answering.asked().find('z'), std::string::npos);
  EXPECT_EQ(bench.run_tampered(answering('4', {}), "set-zero").error, "none");
}

}  // namespace
}  // namespace absenc::e201
