// SPDX-License-Identifier: Apache-2.0
// Tests of procedures that use registers, with the virtual AksIM-2 on UART and SPI.
#include "absenc/protocol/encolink/procedures.hpp"

#include "absenc/protocol/encolink/bench_test.hpp"

namespace absenc::encolink {
namespace {

using testing::Bench;
using testing::RunResult;
using testing::says;
using PowerOn = Bench::PowerOn;
class EncolinkProcedure : public testing::OnBothInterfaces {};
INSTANTIATE_TEST_SUITE_P(Interfaces, EncolinkProcedure, ::testing::Values(Interface::uart, Interface::spi));

TEST_P(EncolinkProcedure, ZeroSurvivesPowerOffWhenSaved) {
  Bench bench(testing::multi, interface);
  const RunResult zero = bench.run("zero");
  ASSERT_EQ(zero.error, Error::none) << zero.detail;
  EXPECT_EQ(zero.reading->singleturn, 0u);
  EXPECT_EQ(zero.numbers.at("position_offset"), (1 << 20) - 0x12345);
  EXPECT_EQ(bench.device.memory_version(), 1u);
  bench.shaft.put(7, 0x22345);
  bench.restart(PowerOn::skip);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0x10000u);
  // The second `zero` changes the offset that the first one stored; it is not saved, so its effect ends at power off.
  ASSERT_EQ(bench.run("zero", {0}).error, Error::none);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0u);
  EXPECT_EQ(bench.device.memory_version(), 1u);
  bench.restart(PowerOn::skip);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0x10000u);
  // The command `reset` sets the offset to 0 without storing it, so the stored offset returns at power on.
  ASSERT_EQ(bench.run("reset").error, Error::none);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0x22345u);
  bench.restart(PowerOn::skip);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0x10000u);
}

TEST_P(EncolinkProcedure, ZeroWorksAtAnyPositionWithAnyOldOffset) {
  for (const std::string_view settings :
       {"", "offset_sign=subtract", "offset_unit=turn_fraction", "offset_unit=turn_fraction offset_sign=subtract"}) {
    for (const std::int64_t place : {0, 1, 0x7FFFF, 0x80000, 0xFFFFF}) {
      Bench bench(settings, interface);
      bench.shaft.put(-3, place);
      const bool fraction = bench.encoder.format().offset_unit == OffsetUnit::turn_fraction;
      ASSERT_EQ(bench.run("memory-write", {0, fraction ? 0xFFFFFFFF : 0xFEDCB}).error, Error::none);
      ASSERT_EQ(bench.run("zero").error, Error::none);
      EXPECT_EQ(bench.run("position").reading->singleturn, 0u);
    }
  }
}

TEST_P(EncolinkProcedure, ZeroWithWrongSignRestoresOldOffset) {
  Bench bench("resolution=20 multiturn_bits=0 offset_sign=subtract", interface);
  bench.tell(testing::single);
  ASSERT_EQ(bench.run("memory-write", {0, 0x10000}).error, Error::none);
  const RunResult wrong = bench.run("zero");
  EXPECT_EQ(wrong.error, Error::cross_check_failed);
  EXPECT_TRUE(says(wrong.advice, "offset_sign")) << wrong.advice;
  EXPECT_EQ(bench.encoder.offset(), 0x10000u);
}

TEST_P(EncolinkProcedure, ZeroNeedsShaftAtRestAndValidPosition) {
  Bench bench(testing::single, interface);
  for (const std::int32_t rpm : {600, 1, -1}) {
    bench.shaft.spin(rpm, bench.line.now());
    EXPECT_EQ(bench.run("zero").error, Error::not_still) << rpm;
  }
  bench.shaft.spin(0, bench.line.now());
  bench.device.raise_alarms(status::signal_lost);
  EXPECT_EQ(bench.run("zero").error, Error::invalid_argument);
  EXPECT_EQ(bench.encoder.offset(), 0u);
}

TEST_P(EncolinkProcedure, PresetsTurns) {
  Bench bench(testing::multi, interface);
  const RunResult preset = bench.run("preset-multiturn", {1234});
  ASSERT_EQ(preset.error, Error::none) << preset.detail;
  EXPECT_EQ(preset.reading->multiturn, 1234u);
  EXPECT_EQ(preset.reading->singleturn, 0x12345u);
  bench.restart(PowerOn::skip);
  EXPECT_EQ(bench.run("position").reading->multiturn, 1234u);

  Bench turnless(testing::single, interface);
  for (const std::string_view told : {testing::single, std::string_view("")}) {
    turnless.tell(told);
    EXPECT_EQ(turnless.run("preset-multiturn").error, Error::unsupported);
  }
}

TEST_P(EncolinkProcedure, SelfCalibrationEmitsProgress) {
  Bench bench(testing::single, interface);
  const RunResult still = bench.run("self-calibrate");
  EXPECT_EQ(still.error, Error::cross_check_failed);
  EXPECT_TRUE(says(still.detail, "did not turn far enough")) << still.detail;
  EXPECT_TRUE(says(still.advice, "turn it evenly")) << still.advice;
  bench.shaft.spin(120, bench.line.now());
  for (const unsigned count : {1u, 2u, 3u, 0u}) {
    unsigned running = 0;
    const RunResult told = bench.run("self-calibrate", {}, [&](const auto& emitted) {
      RunResult now;
      now.take(emitted);
      running += now.numbers.at("running") != 0 ? 1 : 0;
    });
    ASSERT_EQ(told.error, Error::none) << told.detail;
    EXPECT_GE(running, 8u);
    EXPECT_EQ(running, told.emits);
    EXPECT_EQ(told.numbers.at("calibrations"), count);
    EXPECT_EQ(told.numbers.at("running"), 0);
    EXPECT_GT(told.took, calibration_time);
  }
}

}  // namespace
}  // namespace absenc::encolink
