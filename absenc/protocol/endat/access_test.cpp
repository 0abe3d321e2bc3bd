// SPDX-License-Identifier: Apache-2.0
// Commands with a virtual encoder whose requests or replies are changed: an encoder that lacks or refuses something.
#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/endat/protocol.hpp"
#include "absenc/protocol/endat/unit.hpp"

namespace absenc::endat {
namespace {

using author::testing::Talk;
using author::testing::Wire;

constexpr std::uint8_t code_of(ModeCommand code) { return static_cast<std::uint8_t>(code); }

/// A virtual encoder of 25 bits with functions that change its requests and its replies.
struct Bench : author::testing::UnitBench<25> {
  explicit Bench(std::string_view settings) : UnitBench(endat::unit, settings) {
    tampered.requests([this](unsigned, Wire& bytes) {
      // A supplement has zeros and a 1 in front, which is no mode command.
      const bool is_request = is_code(bytes.front());
      if (change_request && is_request) change_request(bytes);
      if (is_request) request = decode_request({bytes, 8 * bytes.size()}).value_or(Request{});
    });
    tampered.replies([this](unsigned, Wire& bytes) {
      if (change_reply) replace(bytes);
    });
  }
  /// Replaces the mode command `from` by `to`, which has the same number of bits.
  void replace_command(ModeCommand from, ModeCommand to) {
    change_request = [from, to](Wire& bytes) {
      if (bytes.front() == code_of(from)) bytes.front() = code_of(to);
    };
  }
  /// Runs a command, and returns with its result what its conversation says about a change of the encoder.
  std::pair<author::testing::RunResult, ChangeSent> change(std::string_view name, std::vector<std::int64_t> arguments) {
    const Talk<std::uint8_t> talk(unit, options, name, std::move(arguments));
    author::testing::RunResult result = run(*talk);
    return {std::move(result), talk->change_sent()};
  }

  std::function<void(Wire& bytes)> change_request{};
  /// Changes the content of a reply to `request`; its checksums are computed anew.
  std::function<void(Reply& reply)> change_reply{};
  Request request{};

 private:
  // Changes the reply in `bytes`, which begins at the first clock behind the request.
  void replace(Wire& bytes) {
    constexpr Format format{.singleturn_bits = 25};
    const BitView bits{bytes, 8 * bytes.size()};
    Request seeking = request;
    seeking.seeks_infos = true;
    Result<Reply> reply = decode_reply(format, seeking, bits);
    if (!reply) return;
    change_reply(*reply);
    BitBuffer<2048> changed;
    for (std::size_t zeros = find_start(bits); zeros > 0; --zeros) changed.append(0, 1);
    encode_reply(format, request.code, *reply, changed);
    while (changed.size() % 8 != 0) changed.append(1, 1);
    bytes.assign(changed.bytes().begin(), changed.bytes().end());
  }
};

/// Changes the content of additional information 1 with the MRS code `mrs` in each reply.
std::function<void(Reply&)> change_info(std::uint8_t mrs, std::function<void(Info&)> change) {
  return [mrs, change = std::move(change)](Reply& reply) {
    for (std::size_t i = 0; i < reply.info_count; ++i) {
      if (reply.infos[i].number == (mrs & 0x1F)) change(reply.infos[i]);
    }
  };
}

TEST(EndatAccess, EncoderWithoutAnAreaIsUnsupported) {
  Bench by_21("singleturn_bits=25 version=2.1");
  by_21.change_reply = [&by_21](Reply& reply) {
    if (by_21.request.code == ModeCommand::select) reply.byte ^= 0xFF;
  };
  const auto refused = by_21.run("memory-read", {0xA9, 0, 1});
  EXPECT_EQ(refused.error, Error::unsupported);
  EXPECT_TRUE(refused.says("does not have this memory area")) << refused.detail;
  Bench by_22("singleturn_bits=25");
  by_22.change_reply = change_info(mrs::acknowledge_mrs, [](Info& info) { info.content = 0xA100; });
  const auto another = by_22.run("memory-read", {0xA9, 0, 1});
  EXPECT_EQ(another.error, Error::unsupported);
  EXPECT_TRUE(another.says("does not have this memory area")) << another.detail;
}

TEST(EndatAccess, WordOfAnotherAddressIsRejected) {
  for (const std::uint8_t mrs : {mrs::memory_low, mrs::memory_high}) {
    Bench bench("singleturn_bits=25");
    bench.change_reply = change_info(mrs, [](Info& info) { info.content ^= 0x0100; });
    const auto read = bench.run("memory-read", {0xA9, 0, 1});
    EXPECT_EQ(read.error, Error::request_rejected) << int{mrs};
    EXPECT_TRUE(read.says("acknowledged another address")) << read.detail;
  }
}

TEST(EndatAccess, EncoderThatStaysBusyEndsAfterTheAccessTime) {
  Bench bench("singleturn_bits=25");
  bench.change_reply = change_info(mrs::memory_low, [](Info& info) { info.busy = true; });
  const auto read = bench.run("memory-read", {0xA9, 0, 1});
  EXPECT_EQ(read.error, Error::busy);
  EXPECT_GT(read.took, memory_access_time);
  EXPECT_LT(read.took, 2 * memory_access_time);
}

TEST(EndatAccess, MissingInformationIsRejected) {
  Bench bench("singleturn_bits=25");
  bench.change_reply = change_info(mrs::internal_temperature, [](Info& info) { info.number = 0; });
  const auto read = bench.run("temperature");
  EXPECT_EQ(read.error, Error::request_rejected);
  EXPECT_TRUE(read.says("does not have this additional information")) << read.detail;
  bench.change_reply = {};
  EXPECT_EQ(bench.run("temperature").numbers.at("temperature_c"), 30);
}

TEST(EndatAccess, EachCommandAsksForTheResolution) {
  const std::vector<std::pair<std::string, std::vector<std::int64_t>>> commands{
      {"position", {}},       {"status", {}},
      {"clear-alarms", {}},   {"temperature", {}},
      {"additional", {0x42}}, {"zero", {}},
      {"reset", {}},          {"error-reset", {}},
      {"info", {}},           {"memory-read", {0xA9, 0}},
      {"line-delay", {}},     {"memory-write", {0xA9, 0, 7}}};
  for (const auto& [name, arguments] : commands) {
    Bench bench("singleturn_bits=25 multiturn_bits=12");
    bench.shaft.put(3, 0x123456);
    bench.tell("singleturn_bits=0");
    const auto result = bench.run(name, arguments);
    EXPECT_EQ(result.error, Error::none) << name << ": " << result.detail;
    if (result.reading && name != "zero") {
      EXPECT_EQ(result.reading->multiturn, 3u) << name;
    }
    EXPECT_EQ(bench.violations(), 0u) << name << ": " << bench.first_violation();
  }
}

TEST(EndatAccess, RefusedWriteIsReported) {
  // An encoder that executes another command than the write keeps its word.
  Bench by_21("singleturn_bits=25 version=2.1");
  by_21.replace_command(ModeCommand::write, ModeCommand::read);
  const auto [refused, change] = by_21.change("memory-write", {0xA9, 8, 0x1234});
  EXPECT_EQ(refused.error, Error::request_rejected);
  EXPECT_TRUE(refused.says("refuses to write this word")) << refused.detail;
  EXPECT_EQ(change, ChangeSent::refused);
  Bench by_22("singleturn_bits=25");
  by_22.replace_command(ModeCommand::write_22, ModeCommand::test_22);
  const auto [kept, not_changed] = by_22.change("memory-write", {0xA9, 8, 0x1234});
  EXPECT_EQ(kept.error, Error::cross_check_failed);
  EXPECT_TRUE(kept.says("reading back gave another value")) << kept.detail;
  EXPECT_EQ(not_changed, ChangeSent::refused);
}

TEST(EndatAccess, WordThatBecameAnotherOneIsReported) {
  Bench bench("singleturn_bits=25 version=2.1");
  bench.change_request = [](Wire& bytes) {
    if (bytes.front() == code_of(ModeCommand::write)) bytes.back() ^= 1;
  };
  const auto [written, change] = bench.change("memory-write", {0xA9, 8, 0x1234});
  EXPECT_EQ(written.error, Error::cross_check_failed);
  EXPECT_TRUE(written.says("reading back gave another value")) << written.detail;
  EXPECT_EQ(change, ChangeSent::yes);
}

TEST(EndatAccess, AlarmsThatRemainAreReported) {
  Bench bench("singleturn_bits=25");
  bench.device.raise_alarms(2);
  bench.replace_command(ModeCommand::write, ModeCommand::read);
  const auto cleared = bench.run("clear-alarms");
  EXPECT_EQ(cleared.error, Error::cross_check_failed);
  EXPECT_TRUE(cleared.says("alarms remain")) << cleared.detail;
  bench.replace_command(ModeCommand::error_reset_22, ModeCommand::test_22);
  const auto reset = bench.run("error-reset");
  EXPECT_EQ(reset.error, Error::cross_check_failed);
  EXPECT_TRUE(reset.says("an error remains")) << reset.detail;
  bench.change_request = {};
  EXPECT_EQ(bench.run("clear-alarms").error, Error::none);
}

TEST(EndatAccess, ClearAlarmsSelectsTheOperatingStatus) {
  Bench bench("singleturn_bits=25");
  bench.device.raise_alarms(2);
  EXPECT_EQ(bench.run("clear-alarms").error, Error::none);
}

TEST(EndatAccess, ErrorResetFindsOutWhichInformationIsSelected) {
  Bench bench("singleturn_bits=25 info1=0x4D info2=0x51");
  bench.device.raise_alarms(1);
  bench.tell("singleturn_bits=25");
  EXPECT_EQ(bench.run("error-reset").error, Error::none);
  EXPECT_EQ(bench.violations(), 0u) << bench.first_violation();
}

TEST(EndatAccess, AdditionalRestoresBothInformations) {
  Bench both("singleturn_bits=25 info1=0x4D info2=0x51");
  ASSERT_EQ(both.run("additional", {0x40, 0x52}).error, Error::none);
  const auto after = both.run("position");
  ASSERT_EQ(after.error, Error::none) << after.detail;
  EXPECT_EQ(after.numbers.at("info1_code"), 0x4D);
  EXPECT_EQ(after.numbers.at("info2_code"), 0x51);
  Bench none("singleturn_bits=25");
  ASSERT_EQ(none.run("additional", {0x40, 0x52}).error, Error::none);
  const auto other = none.run("additional");
  ASSERT_EQ(other.error, Error::none) << other.detail;
  EXPECT_FALSE(other.numbers.contains("info1_code"));
  EXPECT_FALSE(other.numbers.contains("info2_code"));
}

TEST(EndatAccess, ResetsSelectTheInformationFromBeforeAgain) {
  for (const char* const command : {"reset", "error-reset", "zero"}) {
    Bench bench("singleturn_bits=25 info1=0x4D info2=0x51");
    const auto result = bench.run(command);
    ASSERT_EQ(result.error, Error::none) << command << ": " << result.detail;
    const auto after = bench.run("position");
    ASSERT_EQ(after.error, Error::none) << command << ": " << after.detail;
    EXPECT_EQ(after.numbers.at("info1_code"), 0x4D) << command;
    EXPECT_EQ(after.numbers.at("info2_code"), 0x51) << command;
    EXPECT_EQ(bench.violations(), 0u) << command << ": " << bench.first_violation();
  }
}

TEST(EndatAccess, ZeroNeedsASignalPeriod) {
  Bench bench("singleturn_bits=25");
  bench.change_reply = [&bench](Reply& reply) {
    // word 15 of area A1 and word 0 of area A3
    const bool is_periods =
        bench.request.byte == periods_word.address || bench.request.byte == periods_high_word.address;
    if (bench.request.code == ModeCommand::read && is_periods) reply.word = 0;
  };
  const auto [zeroed, change] = bench.change("zero", {});
  EXPECT_EQ(zeroed.error, Error::unsupported);
  EXPECT_TRUE(zeroed.says("states no signal period")) << zeroed.detail;
  EXPECT_EQ(change, ChangeSent::no);
}

TEST(EndatAccess, ZeroReportsAProtectedDatumShift) {
  Bench bench("singleturn_bits=25");
  bench.shaft.put(0, 0x1234567);
  bench.replace_command(ModeCommand::write, ModeCommand::read);
  const auto zeroed = bench.run("zero");
  EXPECT_EQ(zeroed.error, Error::cross_check_failed);
  EXPECT_TRUE(zeroed.says("another datum shift than was written")) << zeroed.detail;
}

TEST(EndatAccess, ZeroNoticesASlowlyTurningShaft) {
  Bench bench("singleturn_bits=25");
  bench.shaft.spin(1, Time{});  // 0.06 degrees between the two positions
  EXPECT_EQ(bench.run("zero").error, Error::not_still);
}

TEST(EndatAccess, RecoveryTimeIsChangedOnlyIfTwoReadsAgree) {
  Bench bench("singleturn_bits=25");
  unsigned reads = 0;
  bench.change_reply = [&](Reply& reply) {
    if (bench.request.code == ModeCommand::read && ++reads == 1) reply.word ^= 0x0100;
  };
  const auto [result, change] = bench.change("set-recovery", {1});
  EXPECT_EQ(result.error, Error::cross_check_failed);
  EXPECT_TRUE(result.says("two reads of the recovery time disagree")) << result.detail;
  EXPECT_EQ(change, ChangeSent::no);
  EXPECT_EQ(bench.run("recovery").numbers.at("recovery"), 0);
}

TEST(EndatAccess, RefusedRecoveryTimeIsReported) {
  Bench bench("singleturn_bits=25");
  bench.replace_command(ModeCommand::write, ModeCommand::read);
  const auto [result, change] = bench.change("set-recovery", {1});
  EXPECT_EQ(result.error, Error::cross_check_failed);
  EXPECT_TRUE(result.says("another recovery time than was written")) << result.detail;
  EXPECT_EQ(change, ChangeSent::refused);
}

// The pause before a position may be the short one only if no command of EnDat 2.1 is just before it.
TEST(EndatAccess, KeepsTheLongRecoveryTimeBehindCommandsOfEndat21) {
  const std::vector<std::pair<std::string, std::vector<std::int64_t>>> commands{{"position", {}},
                                                                                {"status", {}},
                                                                                {"info", {}},
                                                                                {"clear-alarms", {}},
                                                                                {"recovery", {}},
                                                                                {"set-recovery", {1}},
                                                                                {"test-values", {}},
                                                                                {"test-command", {5, 6}},
                                                                                {"communicate", {5, 6}},
                                                                                {"memory-read", {0xA9, 0}},
                                                                                {"memory-read", {0xB9, 2}}};
  for (const char* const resolution : {"25", "0"}) {
    for (const auto& [name, arguments] : commands) {
      for (const std::uint32_t alarms : {0u, std::uint32_t{alarm::error}, 2u}) {
        Bench bench("singleturn_bits=25 recovery=short");
        bench.tell("recovery=short singleturn_bits=" + std::string(resolution));
        bench.device.raise_alarms(alarms);
        static_cast<void>(bench.run(name, arguments));
        bench.tell("singleturn_bits=25 recovery=short");
        EXPECT_EQ(bench.run("position").error, Error::none) << name;
        EXPECT_EQ(bench.violations(), 0u) << name << ", alarms " << alarms << ": " << bench.first_violation();
      }
    }
  }
}

TEST(EndatAccess, ResetIsGivenItsTime) {
  Bench bench("singleturn_bits=25");
  const auto result = bench.run("reset");
  ASSERT_EQ(result.error, Error::none) << result.detail;
  EXPECT_GE(result.reading->latched, result.took - 1ms);
  EXPECT_GE(result.took, 12ms + 50ms);
  EXPECT_LT(result.took, 12ms + 50ms + 2ms);
}

TEST(EndatAccess, LineDelayNeedsAnEarlyStartBit) {
  Bench bench("singleturn_bits=25 line_delay_ns=10000");
  bench.tell("singleturn_bits=25 latency_us=5");
  const auto result = bench.run("line-delay");
  EXPECT_EQ(result.error, Error::unsupported);
  EXPECT_TRUE(result.says("late even at 100 kHz")) << result.detail;
}

TEST(EndatUnit, FollowerNeedsItsStorage) {
  const Options options = author::testing::options_of(endat::unit, "singleturn_bits=25");
  std::vector<std::byte> storage(endat::unit.follower_storage);
  EXPECT_NE(endat::unit.follower(options, storage), nullptr);
  EXPECT_EQ(endat::unit.follower(options, std::span(storage).first(storage.size() - 1)), nullptr);
}

}  // namespace
}  // namespace absenc::endat
