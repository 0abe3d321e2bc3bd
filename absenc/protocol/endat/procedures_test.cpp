// SPDX-License-Identifier: Apache-2.0
// Commands of several requests, with a virtual encoder.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>

#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/endat/device.hpp"
#include "absenc/protocol/endat/unit.hpp"

namespace absenc::endat {
namespace {

struct Bench : author::testing::UnitBench<25> {
  explicit Bench(std::string_view settings = "") : UnitBench(endat::unit, settings) {}
};

TEST(EndatProcedures, AskForTheResolution) {
  for (const std::string version : {"2.1", "2.2"}) {
    Bench known("singleturn_bits=25 multiturn_bits=12 version=" + version);
    known.shaft.put(3, 0x123456);
    known.options = author::testing::options_of(endat::unit, "singleturn_bits=0 version=" + version);
    const auto read = known.run("position");
    ASSERT_EQ(read.error, Error::none) << read.detail;
    EXPECT_EQ(read.reading->singleturn_bits, 25u);
    EXPECT_EQ(read.reading->multiturn_bits, 12u);
    EXPECT_EQ(read.reading->singleturn, 0x123456u);
    EXPECT_EQ(read.reading->multiturn, 3u);
    EXPECT_EQ(known.violations(), 0u) << known.first_violation();
  }
  Bench linear("singleturn_bits=0 position_bits=32 unit_um=0.05");
  linear.options = author::testing::options_of(endat::unit, "singleturn_bits=0");
  const auto read = linear.run("position");
  ASSERT_EQ(read.error, Error::none) << read.detail;
  EXPECT_EQ(read.reading->singleturn_bits, 32u);
  EXPECT_DOUBLE_EQ(read.reading->unit_um, 0.05);
}

TEST(EndatProcedures, RefusesAResolutionThatContradictsItself) {
  // Words in the encoder's memory: each takes two bytes, area A1 begins with word 4 and area A3 follows it.
  constexpr std::size_t count_at = 2 * (0x0D - 4);
  constexpr std::size_t steps_at = 2 * (12 + 4);
  const auto asked_with = [](std::size_t at, std::initializer_list<std::uint8_t> bytes) {
    Bench bench("singleturn_bits=25");
    std::copy(bytes.begin(), bytes.end(), bench.device.memory().begin() + static_cast<std::ptrdiff_t>(at));
    bench.options = author::testing::options_of(endat::unit, "singleturn_bits=0");
    return bench.run("position");
  };
  EXPECT_TRUE(asked_with(steps_at, {3, 0, 0, 0}).says("no power of two"));
  EXPECT_EQ(asked_with(steps_at, {3, 0, 0, 0}).error, Error::unsupported);
  EXPECT_EQ(asked_with(count_at, {60, 0x80}).error, Error::unsupported);
  EXPECT_EQ(asked_with(steps_at, {0, 0, 0, 1}).error, Error::cross_check_failed) << "24 bits of 25";
}

TEST(EndatProcedures, StatusNamesErrorsAndWarnings) {
  Bench bench("singleturn_bits=25");
  EXPECT_EQ(bench.run("status").numbers.at("alarms"), 0);
  bench.device.raise_alarms(0x0202);
  const auto position = bench.run("position");
  EXPECT_EQ(position.reading->alarms, 0x0202 | alarm::error | alarm::warning);
  EXPECT_EQ(position.reading->singleturn_validity(), Validity::invalid);
  const auto status = bench.run("status");
  EXPECT_EQ(status.numbers.at("alarms"), std::int64_t{0x0202 | alarm::error | alarm::warning});
  EXPECT_EQ(bench.run("clear-alarms").error, Error::none);
  EXPECT_EQ(bench.run("status").numbers.at("alarms"), 0);
  // A warning without a name is only the group bit.
  bench.device.raise_alarms(alarm::warning);
  EXPECT_EQ(bench.run("status").numbers.at("alarms"), std::int64_t{alarm::warning});
  EXPECT_EQ(bench.run("clear-alarms").error, Error::none);
  EXPECT_EQ(bench.run("status").numbers.at("alarms"), 0);
  EXPECT_EQ(bench.violations(), 0u) << bench.first_violation();
}

TEST(EndatProcedures, PositionDoesNotKnowWarningsWithoutAdditionalInformation) {
  Bench bench("singleturn_bits=25");
  bench.device.raise_alarms(0x0200);
  const Reading plain = *bench.run("position").reading;
  EXPECT_EQ(plain.alarms, 0u);
  EXPECT_EQ(plain.alarms_reported, alarm::error | alarm::errors);
  const Reading wrong = reading_of({.singleturn_bits = 25}, ModeCommand::position, {.f1 = true});
  EXPECT_EQ(wrong.singleturn_validity(), Validity::invalid);
  EXPECT_EQ(wrong.alarms_reported, 0u) << "which error message is set is not known";
  Bench informed("singleturn_bits=25 info1=0x40");
  informed.device.raise_alarms(0x0200);
  EXPECT_EQ(informed.run("position").reading->alarms, 0x0200 | alarm::warning);
}

TEST(EndatProcedures, MemoryByBothVersions) {
  for (const std::string version : {"2.1", "2.2"}) {
    Bench bench("singleturn_bits=25 version=" + version);
    const auto written = bench.run("memory-write", {0xAB, 100, 0x1234});
    ASSERT_EQ(written.error, Error::none) << version << ": " << written.detail;
    EXPECT_EQ(written.numbers.at("written"), 1);
    EXPECT_EQ(bench.run("memory-write", {0xAB, 100, 0x1234}).numbers.at("written"), 0);
    EXPECT_EQ(bench.run("memory-read", {0xAB, 100, 1}).numbers.at("value"), 0x1234);
    EXPECT_EQ(bench.run("memory-read", {0xAB, 99, 3}).texts.at("data"), std::string("\0\0\x34\x12\0\0", 6));
    EXPECT_EQ(bench.run("memory-write", {0xA1, 13, 1}).error, Error::invalid_argument);
    EXPECT_EQ(bench.run("memory-read", {0xA1, 3, 1}).error, Error::invalid_argument);
    EXPECT_EQ(bench.violations(), 0u) << version << ": " << bench.first_violation();
  }
}

TEST(EndatProcedures, SelectionFromBeforeIsRestored) {
  Bench bench("singleturn_bits=25 info1=0x4D info2=0x51");
  EXPECT_EQ(bench.run("memory-read", {0xA1, 13, 1}).numbers.at("value"), 0x8019);
  EXPECT_EQ(bench.run("temperature").numbers.at("temperature_c"), 30);
  const auto after = bench.run("position");
  ASSERT_EQ(after.error, Error::none) << after.detail;
  EXPECT_EQ(after.numbers.at("info1_code"), 0x4D);
  EXPECT_EQ(after.numbers.at("info2_code"), 0x51);
  // The host finds out what is selected even if its options do not say so.
  bench.options = author::testing::options_of(endat::unit, "singleturn_bits=25");
  EXPECT_EQ(bench.run("temperature").error, Error::none);
  EXPECT_EQ(bench.violations(), 0u) << bench.first_violation();
}

TEST(EndatProcedures, EveryAdditionalInformation) {
  Bench bench("singleturn_bits=25");
  bench.shaft.put(0, 0x123456);
  for (std::int64_t first = 0x40; first < 0x4F; ++first) {
    for (const std::int64_t second : {0, 0x50, 0x51, 0x52, 0x54, 0x56, 0x59, 0x5B}) {
      const auto read = bench.run("additional", {first, second});
      ASSERT_EQ(read.error, Error::none) << first << ' ' << second << ": " << read.detail;
      EXPECT_EQ(read.numbers.at("info1_code"), first);
      if (second != 0) {
        EXPECT_EQ(read.numbers.at("info2_code"), second);
      }
      EXPECT_EQ(read.numbers.at("singleturn"), 0x123456);
    }
  }
  EXPECT_EQ(bench.run("additional", {0x42, 0}).numbers.at("info1"), 0x3456);
  EXPECT_EQ(bench.run("additional", {0x43, 0x57}).numbers.at("info2"), 0x0012);
  EXPECT_EQ(bench.run("additional", {0, 0x5A}).error, Error::request_rejected);
  EXPECT_EQ(bench.violations(), 0u) << bench.first_violation();
}

// Inverts the lowest bit of the MRS code in a position of 25 bits with one information, with a correct checksum.
void relabel(author::testing::Wire& bytes) {
  constexpr std::size_t first = turn_bits + 1 + 2 + 25 + crc_bits + 1;
  constexpr std::size_t lowest_of_code = first + 3 + 4;
  BitBuffer<400> bits;
  for (std::size_t i = 0; i < first + parameter_bits; ++i) {
    bits.append(BitView{bytes, 8 * bytes.size()}[i] != (i == lowest_of_code) ? 1 : 0, 1);
  }
  bits.append(crc_of_bits(bits.view(), first, parameter_bits), crc_bits);
  while (bits.size() % 8 != 0) bits.append(1, 1);
  std::copy(bits.bytes().begin(), bits.bytes().end(), bytes.begin());
}

TEST(EndatProcedures, SearchForSelectionEndsAfterTwentyPositions) {
  for (const unsigned changing : {18u, 19u}) {
    Bench bench("singleturn_bits=25 info1=0x4D");
    unsigned positions = 0;
    bench.tampered.replies([&](unsigned nth, author::testing::Wire& bytes) {
      ++positions;
      if (std::min(nth, changing) % 2 == 1) relabel(bytes);
    });
    bench.options = author::testing::options_of(endat::unit, "singleturn_bits=25");
    const auto read = bench.run("additional", {0, 0});
    if (changing == 18) {
      EXPECT_EQ(read.error, Error::none) << "positions 19 and 20 agree: " << read.detail;
    } else {
      EXPECT_EQ(read.error, Error::cross_check_failed);
      EXPECT_TRUE(read.says("changes from position to position")) << read.detail;
      EXPECT_EQ(positions, 20u);
    }
  }
}

TEST(EndatProcedures, ZeroByDatumShift) {
  for (const std::string shift : {"subtracted", "added"}) {
    Bench bench("singleturn_bits=25 datum_shift=" + shift);
    bench.shaft.put(0, 0x1234567);
    const auto zeroed = bench.run("zero");
    ASSERT_EQ(zeroed.error, Error::none) << zeroed.detail;
    // A signal period has 2^14 counts, so the position is at most half of it away from 0.
    EXPECT_LE(std::abs(wrapped_difference(zeroed.reading->singleturn, 0, 25)), 1 << 13);
    // A host that takes the other sign finds out.
    Bench other("singleturn_bits=25 datum_shift=" + shift);
    other.shaft.put(0, 0x1234567);
    other.options = author::testing::options_of(
        endat::unit, std::string("singleturn_bits=25 datum_shift=") + (shift == "added" ? "subtracted" : "added"));
    EXPECT_EQ(other.run("zero").error, Error::cross_check_failed);
  }
  Bench turning("singleturn_bits=25");
  turning.shaft.spin(60, Time{});
  EXPECT_EQ(turning.run("zero").error, Error::not_still);
}

TEST(EndatProcedures, RecoveryTimeIsReadBack) {
  Bench bench("singleturn_bits=25");
  EXPECT_EQ(bench.run("recovery").numbers.at("recovery"), 0);
  EXPECT_EQ(bench.run("set-recovery", {1}).numbers.at("written"), 1);
  EXPECT_EQ(bench.run("recovery").numbers.at("recovery"), 1);
  bench.options = author::testing::options_of(endat::unit, "singleturn_bits=25 recovery=short");
  EXPECT_EQ(bench.run("position").error, Error::none);
  EXPECT_EQ(bench.run("position").error, Error::none);
  EXPECT_EQ(bench.violations(), 0u) << bench.first_violation();
}

TEST(EndatProcedures, ResetEndsAdditionalInformationAndErrors) {
  Bench bench("singleturn_bits=25 info1=0x4D");
  bench.device.raise_alarms(1);
  const auto after = bench.run("reset");
  ASSERT_EQ(after.error, Error::none) << after.detail;
  EXPECT_FALSE(after.numbers.contains("info1"));
  EXPECT_EQ(after.numbers.at("f1"), 0);
  Bench errors("singleturn_bits=25");
  errors.device.raise_alarms(1);
  EXPECT_EQ(errors.run("error-reset").numbers.at("f1"), 0);
}

TEST(EndatProcedures, MeasuresTheDelayOfTheLine) {
  for (const int delay : {300, 700, 1200}) {
    Bench bench("singleturn_bits=25 clock_khz=8000 line_delay_ns=" + std::to_string(delay));
    bench.options = author::testing::options_of(endat::unit, "singleturn_bits=25 clock_khz=8000 latency_us=5");
    const auto measured = bench.run("line-delay");
    ASSERT_EQ(measured.error, Error::none) << measured.detail;
    EXPECT_NEAR(static_cast<double>(measured.numbers.at("line_delay_ns")), delay, delay * 0.04);
    EXPECT_EQ(measured.numbers.at("delay_shorter"), 0);
  }
  // A delay below half a period of the fastest clock at which the position is ready in time moves no start bit.
  Bench near("singleturn_bits=25 clock_khz=8000 line_delay_ns=20");
  near.options = author::testing::options_of(endat::unit, "singleturn_bits=25 clock_khz=8000 latency_us=5");
  const auto short_one = near.run("line-delay");
  EXPECT_EQ(short_one.numbers.at("line_delay_ns"), 250);
  EXPECT_EQ(short_one.numbers.at("delay_shorter"), 1);
}

TEST(EndatProcedures, DelayIsLongerOnPortsThatSampleLate) {
  // A port that samples a whole period behind the edge: of the same delay, it needs twice as much to miss a clock.
  struct LatePort final : Machine<std::uint8_t> {
    explicit LatePort(Machine<std::uint8_t>& of) : host(of) {}
    void feed(const ByteEvent& event) override {
      ByteEvent late = event;
      if (event.kind == ByteEvent::Kind::received) late.width = Time(1'000'000'000 / rate);
      host.feed(late);
    }
    ByteStep next(Time now) override {
      const ByteStep step = host.next(now);
      if (step.kind == ByteStep::Kind::transfer) rate = step.rate;
      return step;
    }
    Machine<std::uint8_t>& host;
    std::uint32_t rate = 1;
  };
  Bench bench("singleturn_bits=25 clock_khz=8000 line_delay_ns=700");
  bench.options = author::testing::options_of(endat::unit, "singleturn_bits=25 clock_khz=8000 latency_us=5");
  const author::testing::Talk<std::uint8_t> talk(bench.unit, bench.options, "line-delay");
  LatePort host(*talk);
  bench.line.converse(host);
  author::testing::RunResult measured;
  measured.take(*talk);
  ASSERT_EQ(measured.error, Error::none) << measured.detail;
  EXPECT_NEAR(static_cast<double>(measured.numbers.at("line_delay_ns")), 1400, 56);
}

TEST(EndatProcedures, InfoDescribesTheEncoder) {
  Bench bench("singleturn_bits=25 multiturn_bits=12");
  const auto info = bench.run("info");
  ASSERT_EQ(info.error, Error::none) << info.detail;
  EXPECT_EQ(info.numbers.at("position_bits"), 37);
  EXPECT_EQ(info.numbers.at("revolutions"), 4096);
  EXPECT_EQ(info.numbers.at("measuring_steps"), 1 << 25);
  EXPECT_EQ(info.numbers.at("signal_periods"), 2048);
  EXPECT_EQ(info.texts.at("kind"), "rotary, multi-turn with gears");
  EXPECT_EQ(info.numbers.at("endat_22"), 1);
  bench.options = author::testing::options_of(endat::unit, "singleturn_bits=13");
  EXPECT_EQ(bench.run("info").error, Error::cross_check_failed);
}

TEST(EndatProcedures, CommandsOfEndat22NeedIt) {
  Bench bench("singleturn_bits=25 version=2.1");
  for (const char* const command : {"temperature", "additional", "error-reset", "recovery"}) {
    EXPECT_EQ(bench.run(command).error, Error::unsupported) << command;
  }
}

}  // namespace
}  // namespace absenc::endat
