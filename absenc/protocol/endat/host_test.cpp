// SPDX-License-Identifier: Apache-2.0
// Hosts and the virtual encoder on a simulated line: times, directions, additional information, memory.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "absenc/protocol/endat/bench_test.hpp"

namespace absenc::endat {
namespace {

using testing::Ask;
using testing::Bench;

Result<Reply> ask(Bench& bench, const Format& format, const Request& request) {
  Ask host(format, request);
  bench.run(host);
  return host.error() == Error::none ? Result<Reply>(host.last()) : Result<Reply>(host.error());
}

constexpr Format rotary{.singleturn_bits = 25};

TEST(EndatHost, ReadsEveryLengthAtEveryClock) {
  for (const std::uint8_t bits : std::to_array<std::uint8_t>({13, 25, 32, 37})) {
    for (const std::uint16_t khz : std::to_array<std::uint16_t>({200, 2000, 8000, 16000})) {
      for (const std::uint32_t delay : {0u, 40u, 70u, 300u, 1200u}) {
        const Format format{.singleturn_bits = bits, .clock_khz = khz, .line_delay_ns = delay};
        Bench bench(format);
        bench.shaft.place = 0x1234'5678;
        const Result<Reply> reply = ask(bench, format, {.code = ModeCommand::position_22});
        ASSERT_TRUE(reply) << int(bits) << ' ' << khz << ' ' << delay;
        const std::int64_t expected = bits > 32 ? std::int64_t{0x1234'5678} << (bits - 32) : 0x1234'5678 >> (32 - bits);
        EXPECT_EQ(static_cast<std::int64_t>(reply->position), expected) << int(bits) << ' ' << khz << ' ' << delay;
        EXPECT_EQ(bench.encoder.violation_count(), 0u);
      }
    }
  }
}

TEST(EndatHost, WithoutCompensationMissesTheLastBits) {
  const Format delayed{.singleturn_bits = 25, .clock_khz = 8000, .latency = 4us, .line_delay_ns = 400};
  Bench bench(delayed);
  Format host = delayed;
  host.line_delay_ns = 0;
  EXPECT_EQ(ask(bench, host, {.code = ModeCommand::position_22}).error(), Error::truncated);
  EXPECT_TRUE(ask(bench, delayed, {.code = ModeCommand::position_22}));
}

TEST(EndatHost, KeepsRecoveryTimeOfEachVersion) {
  for (const Recovery recovery : {Recovery::long_time, Recovery::short_time}) {
    Format format = rotary;
    format.recovery = recovery;
    Bench bench(format);
    ASSERT_TRUE(ask(bench, format, {.code = ModeCommand::position_22}));
    const Time before = bench.line.now();
    Ask host(format, {.code = ModeCommand::position_22});
    bench.run(host);
    EXPECT_EQ(host.begun_at() - before, recovery == Recovery::long_time ? Time(30us) : Time(3750ns));
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

TEST(EndatHost, WaitsForTheLongestTimesOfTheSources) {
  Format format = rotary;
  format.clock_khz = 8000;
  Bench slow(format, {.latency = 10us, .read_time = 11'990us});
  EXPECT_TRUE(ask(slow, format, {.code = ModeCommand::position_22})) << "the default of latency_us";
  EXPECT_TRUE(ask(slow, format, {.code = ModeCommand::select, .byte = area::maker_1})) << "an access takes up to 12 ms";
}

TEST(EndatEncoder, TakesThePeriodOfItsFormatIfThePortDoesNotKnowIt) {
  testing::SetShaft shaft;
  VirtualEncoder encoder(rotary, shaft, {.latency = 20us});
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  constexpr std::array<std::uint8_t, 1> command{0x38};
  encoder.feed({.kind = ByteEvent::Kind::selected, .at = 1ms});
  encoder.feed({.kind = ByteEvent::Kind::received, .at = 1ms + 8us, .items = command, .bits = 8});
  const ByteStep step = encoder.next(1ms + 8us);
  EXPECT_EQ(find_start({step.out, 8 * step.out.size()}), 20u - command_bits) << "1 MHz";
  EXPECT_EQ(encoder.violation_count(), 0u);
}

TEST(EndatEncoder, IgnoresExchangeWithinRecoveryTime) {
  Bench bench(rotary);
  ASSERT_TRUE(ask(bench, rotary, {.code = ModeCommand::position_22}));
  Format hasty = rotary;
  hasty.recovery = Recovery::short_time;
  EXPECT_EQ(ask(bench, hasty, {.code = ModeCommand::position_22}).error(), Error::line_stuck);
  EXPECT_EQ(bench.encoder.violations()[0].rule, rules::recovery);
}

// A host that sends more or less than its mode command asks for.
struct Script final : Machine<std::uint8_t> {
  explicit Script(std::vector<ByteStep> all) : steps(std::move(all)) {}
  void feed(const ByteEvent& event) override { waits = waits && event.kind != ByteEvent::Kind::sent; }
  ByteStep next(Time) override {
    if (waits) return {.at = never};
    if (index == steps.size()) return {.kind = ByteStep::Kind::done};
    waits = true;
    return steps[index++];
  }
  std::vector<ByteStep> steps;
  std::size_t index = 0;
  bool waits = false;
};

TEST(EndatEncoder, NamesBothWhenHostDrivesIntoTheReply) {
  constexpr std::array<std::uint8_t, 2> two_bytes{0x38, 0x00};
  constexpr std::array<std::uint8_t, 1> command{0x09};
  const auto broken_by = [](std::vector<ByteStep> steps) {
    Bench bench(rotary);
    Script host(std::move(steps));
    bench.run(host);
    EXPECT_GE(bench.encoder.violation_count(), 1u);
    return std::string(bench.encoder.violations()[0].rule);
  };
  using Kind = ByteStep::Kind;
  EXPECT_EQ(broken_by({{.kind = Kind::transfer, .out = two_bytes, .bits = 60, .out_bits = 16}}), rules::collision);
  EXPECT_EQ(broken_by({{.kind = Kind::transfer, .goes_on = true, .out = command, .bits = 30, .out_bits = 8},
                       {.kind = Kind::transfer, .out = command, .bits = 8, .out_bits = 8}}),
            rules::early_supplement);
  EXPECT_EQ(broken_by({{.kind = Kind::transfer, .out = command, .bits = 20, .out_bits = 8}}), rules::few_clocks);
}

TEST(EndatEncoder, RefusesAreasAndWordsThatItDoesNotHave) {
  Bench bench(rotary);
  const auto error_of = [&bench](const Request& request) { return ask(bench, rotary, request).error(); };
  EXPECT_EQ(error_of({.code = ModeCommand::select, .byte = 0xBB}), Error::request_rejected);
  EXPECT_EQ(error_of({.code = ModeCommand::read, .byte = 0x0D}), Error::request_rejected) << "no area is selected";
  EXPECT_EQ(error_of({.code = ModeCommand::select, .byte = area::maker_1}), Error::none);
  EXPECT_EQ(error_of({.code = ModeCommand::read, .byte = 0x0D}), Error::none);
  EXPECT_EQ(error_of({.code = ModeCommand::read, .byte = 0x03}), Error::request_rejected);
  EXPECT_EQ(error_of({.code = ModeCommand::write, .byte = 0x0D, .word = 1}), Error::request_rejected)
      << "the maker's words cannot be written";
  EXPECT_EQ(ask(bench, rotary, {.code = ModeCommand::read, .byte = 0x0D})->word, 0x8019);
}

TEST(EndatEncoder, SaysWhenTheClockIsTooFastOrTooSlow) {
  const auto broken_at = [](std::uint32_t rate, CommandSet version) {
    Format format = rotary;
    format.version = version;
    Bench bench(format);
    constexpr std::array<std::uint8_t, 1> command{0x07};
    Script host({{.kind = ByteStep::Kind::transfer, .out = command, .bits = 120, .out_bits = 8, .rate = rate}});
    bench.run(host);
    return bench.encoder.violation_count() == 0 ? std::string() : std::string(bench.encoder.violations()[0].rule);
  };
  EXPECT_EQ(broken_at(2'000'000, CommandSet::v21), "");
  EXPECT_EQ(broken_at(2'100'000, CommandSet::v21), rules::fastest);
  EXPECT_EQ(broken_at(8'000'000, CommandSet::v22), "");
  EXPECT_EQ(broken_at(90'000, CommandSet::v22), rules::slowest);
}

TEST(EndatEncoder, SaysWhenParametersAreClockedTooFast) {
  Bench bench(rotary);
  constexpr std::array<std::uint8_t, 4> select{0x0E, area::maker_1, 0, 0};
  Script host({{.kind = ByteStep::Kind::transfer, .out = select, .bits = 1200, .out_bits = 32, .rate = 4'000'000}});
  bench.run(host);
  ASSERT_EQ(bench.encoder.violation_count(), 1u);
  EXPECT_EQ(bench.encoder.violations()[0].rule, rules::parameter_clock);
}

TEST(EndatEncoder, IgnoresAnAccessWhileItIsBusy) {
  Bench bench(rotary);
  Format informed = rotary;
  ASSERT_TRUE(ask(bench, informed, {.code = ModeCommand::select_22, .byte = area::maker_1}));
  ASSERT_TRUE(ask(bench, informed, {.code = ModeCommand::select_22, .byte = mrs::memory_low}));
  informed.info1 = mrs::memory_low;
  ASSERT_TRUE(ask(bench, informed, {.code = ModeCommand::read_22, .byte = 0x0D}));
  ASSERT_TRUE(ask(bench, informed, {.code = ModeCommand::read_22, .byte = 0x0E}));
  ASSERT_EQ(bench.encoder.violation_count(), 1u);
  EXPECT_EQ(bench.encoder.violations()[0].rule, rules::busy);
  bench.line.run_until(bench.line.now() + 1ms);
  const Result<Reply> reply = ask(bench, informed, {.code = ModeCommand::position_22});
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->info(1)->content, 0x0D19) << "the word of the first access";
  EXPECT_FALSE(reply->info(1)->busy);
}

// The start bit comes at the first clock that begins when the encoder is ready, to the nanosecond.
TEST(EndatEncoder, SendsTheStartBitWhenItIsReady) {
  const auto start_after = [](const EncoderTimes& times, const Request& request) {
    Bench bench(rotary, times);
    if (request.code == ModeCommand::read) {
      static_cast<void>(ask(bench, rotary, {.code = ModeCommand::select, .byte = area::maker_1}));
    }
    const Result<Reply> reply = ask(bench, rotary, request);
    return reply ? reply->start : 0;
  };
  const Request position{.code = ModeCommand::position_22};
  EXPECT_EQ(start_after({.latency = 10us}, position), 10u);
  EXPECT_EQ(start_after({.latency = 9'001ns}, position), 10u);
  EXPECT_EQ(start_after({.latency = 2us}, position), 10u) << "not before the line has turned";
  Format slow = rotary;
  slow.latency = 20us;
  for (const auto& [latency, start] : {std::pair{Time(12'000ns), 12}, std::pair{Time(12'001ns), 13}}) {
    Bench bench(slow, {.latency = latency});
    const Result<Reply> reply = ask(bench, slow, position);
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->start, start);
  }
  const Request read{.code = ModeCommand::read, .byte = 0x0D};
  constexpr std::size_t turned = access_bits + turn_bits;  // clocks of 10 us
  EXPECT_EQ(start_after({.read_time = 200us}, read), turned + 20);
  EXPECT_EQ(start_after({.read_time = 200'001ns}, read), turned + 21);
}

}  // namespace
}  // namespace absenc::endat
