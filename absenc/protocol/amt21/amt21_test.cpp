// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/amt21/unit.hpp"
#include "absenc/sim/unit_bench_test.hpp"

namespace absenc::amt21 {
namespace {

using Bench = sim::testing::UnitBench;

TEST(Amt21, AnswersInTheTimesOfItsDatasheet) {
  constexpr std::array<const char*, 5> names{"2000000", "115200", "38400", "19200", "9600"};
  constexpr std::array<Time, 5> times{3us, 10'800ns, 30us, 56us, 110us};
  for (std::size_t i = 0; i < names.size(); ++i) {
    Bench bench(unit, {{"rate", names[i]}});
    const auto host = bench.send({0x54}, 5ms, 5ms);
    EXPECT_EQ(host.first_byte_at - host.sent_at, times[i] + LineSettings{.rate = rates[i]}.character());
    bench.encoder().power_off(bench.line->now());
    EXPECT_EQ(bench.run("position").error, Error::timeout);
  }
}
TEST(Amt21, RestartsFor200MsAfterItsTwoExtendedCommands) {
  for (const std::uint8_t code : std::to_array<std::uint8_t>({0x5E, 0x75, 0x5F})) {
    Bench bench(unit);
    EXPECT_TRUE(bench.send({0x56, code}, 100us, 100us).reply.empty());
    for (const Time pause : {0us, 199'600us}) {
      bench.pass(pause);
      EXPECT_EQ(bench.send({0x54}, 100us, 100us).reply.empty(), code != 0x5F);
    }
    bench.pass(400us);
    EXPECT_EQ(bench.send({0x54}, 100us, 100us).reply.size(), 2u);
  }
}
TEST(Amt21, ZeroIsWhereTheShaftStandsStill) {
  Bench bench(unit);
  bench.shaft.put(3, 0x4000'0000);
  EXPECT_EQ(bench.run("zero").error, Error::none);
  EXPECT_EQ(bench.run("position").numbers["singleturn"], 0);
  bench.shaft.put(3, 0x8000'0000);
  bench.tamper = [](unsigned index, Bench::Wire& reply) { reply = index < 3 ? reply : Bench::Wire{0xAB, 0x61}; };
  EXPECT_EQ(bench.run("zero").detail, "the position is still not zero");
  bench.tamper = {};
  bench.shaft.spin(60, bench.line->now());
  const std::uint64_t asked = bench.encoder().answered();
  EXPECT_EQ(bench.run("zero").error, Error::invalid_argument);
  EXPECT_EQ(bench.encoder().answered(), asked + 2);
}
TEST(Amt21, TurnsAreLostWithoutABatteryAndCannotBeZeroed) {
  Bench bench(unit, {{"multiturn_bits", "14"}});
  bench.shaft.put(-5, 100);
  EXPECT_EQ(bench.run("position").numbers["multiturn"], -5);
  EXPECT_EQ(bench.run("zero").error, Error::unsupported);
  EXPECT_TRUE(bench.send({0x56, 0x5E}, 100us, 100us).reply.empty());
  EXPECT_EQ(bench.encoder().violation_count(), 1u);
  for (const std::int64_t battery : {1, 0}) {
    bench.encoder().set_condition(0, battery, bench.line->now());
    bench.encoder().power_off(bench.line->now());
    bench.encoder().power_on(bench.line->now(), Bench::PowerOn::skip);
    EXPECT_EQ(bench.run("turns").numbers["multiturn"], battery * -5);
  }
}
TEST(Amt21, ReadsTurnsOfASideOfZero) {
  Bench bench(unit, {{"multiturn_bits", "14"}});
  bench.shaft.put(0, -4'000'000);
  bench.shaft.spin(600, bench.line->now());
  for (int i = 0; i < 100; ++i) {
    const auto both = bench.run("position");
    const std::int64_t counts = both.numbers.at("multiturn") * 16384 + both.numbers.at("singleturn");
    EXPECT_NEAR(static_cast<double>(counts), static_cast<double>(bench.shaft.at(bench.line->now()).position >> 18), 20);
  }
}

}  // namespace
}  // namespace absenc::amt21
