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
    EXPECT_EQ(host.begun_at() - before, recovery == Recovery::long_time ? long_recovery : short_recovery);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
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

}  // namespace
}  // namespace absenc::endat
