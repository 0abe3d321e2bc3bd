// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "absenc/protocol/amt21/unit.hpp"
#include "absenc/protocol/author/unit_bench_test.hpp"

namespace absenc::amt21 {
namespace {

using Bench = author::testing::UnitBench<32>;
constexpr const char* with_turns = "multiturn_bits=14";

TEST(Amt21, RepliesAfterTheTurnAroundTimeOfEachRate) {
  constexpr std::array<const char*, 5> names{"rate=2000000", "rate=115200", "rate=38400", "rate=19200", "rate=9600"};
  constexpr std::array<Time, 5> times{3us, 10'800ns, 30us, 56us, 110us};
  for (std::size_t i = 0; i < names.size(); ++i) {
    Bench bench(unit, names[i]);
    const auto host = bench.raw({0x54});
    EXPECT_EQ(host.first_byte_at - host.sent_at, times[i] + LineSettings{.rate = rates[i]}.character());
  }
}
TEST(Amt21, RestartsFor200MsAfterZeroAndReset) {
  for (const std::uint8_t code : std::to_array<std::uint8_t>({0x5E, 0x75, 0x5F})) {
    Bench bench(unit, "");
    EXPECT_TRUE(bench.raw({0x56, code}, 100us).reply.empty());
    bench.pass(199'600us);
    EXPECT_EQ(bench.raw({0x54}, 100us, 100us).reply.empty(), code != 0x5F);
    bench.pass(400us);
    EXPECT_EQ(bench.raw({0x54}, 100us).reply.size(), 2u);
  }
}
TEST(Amt21, ZeroNeedsShaftAtRestAndIsVerified) {
  Bench bench(unit, "");
  bench.shaft.put(3, 0x4000'0000);
  const author::testing::RunResult zeroed = bench.run("zero");
  EXPECT_EQ(zeroed.error, Error::none);
  EXPECT_EQ(zeroed.change, ChangeSent::yes);
  EXPECT_EQ(bench.run("position").numbers["singleturn"], 0);
  EXPECT_EQ(bench.run("zero").change, ChangeSent::unproven);
  bench.tampered.replies([](unsigned nth, auto& reply) {
    if (nth > 2) reply = {0xAB, 0x61};
  });
  EXPECT_EQ(bench.run("zero").detail, "the position is still not zero");
  bench.tampered.replies({});
  bench.shaft.spin(60, bench.line.now());
  const author::testing::RunResult refused = bench.run("zero");
  EXPECT_EQ(refused.error, Error::not_still);
  EXPECT_EQ(refused.frames, 2u);
}
TEST(Amt21, LosesTurnsWithoutBatteryAndRefusesZeroWithTurns) {
  Bench bench(unit, with_turns);
  bench.shaft.put(-5, 100);
  EXPECT_EQ(bench.run("zero").error, Error::unsupported);
  std::array<std::uint8_t, 2> request{};
  EXPECT_EQ(unit.encode(bench.options, *find_command(unit, "zero"), {}, request).error(), Error::unsupported);
  EXPECT_TRUE(bench.raw({0x56, 0x5E}).reply.empty());
  EXPECT_EQ(bench.device.violation_count(), 1u);
  for (const std::int64_t battery : {1, 0}) {
    bench.condition(0, battery);
    bench.restart(Bench::PowerOn::skip);
    EXPECT_EQ(bench.run("turns").numbers["multiturn"], battery * -5);
  }
}
TEST(Amt21, ReadsTurnsThatMatchThePositionAtZeroCrossing) {
  Bench bench(unit, with_turns);
  bench.shaft.spin(600, Time{});
  for (int i = 0; i < 100; ++i) {
    auto both = bench.run("position");
    const std::int64_t counts = both.numbers["multiturn"] * 16384 + both.numbers["singleturn"];
    EXPECT_LE(std::abs(counts - (bench.shaft.at(bench.line.now()).position >> 18)), 20);
    bench.pass(1ms);
  }
}

TEST(Amt21, ScanFindsSingleEncoder) {
  Bench bench(unit, "address=0x58");
  const author::testing::RunResult found = bench.run("scan");
  EXPECT_EQ(found.error, Error::none);
  EXPECT_EQ(found.numbers.at("encoder_address"), 0x58);
}

TEST(Amt21, RejectsReservedRequest) {
  for (const std::uint8_t reserved : std::to_array<std::uint8_t>({0x57, 0x03, 0xFF})) {
    EXPECT_EQ(Protocol::decode_request({}, std::array{reserved}).error(), Error::unexpected_reply);
  }
}
TEST(Amt21, RejectsEmptyRequest) { EXPECT_EQ(Protocol::decode_request({}, {}).error(), Error::wrong_length); }

}  // namespace
}  // namespace absenc::amt21
