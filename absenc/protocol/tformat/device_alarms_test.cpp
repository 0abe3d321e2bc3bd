// SPDX-License-Identifier: Apache-2.0
// Tests of the virtual Smart-Abs: alarms (6.5), battery and power.
#include <gtest/gtest.h>

#include "absenc/protocol/tformat/bench_test.hpp"
#include "absenc/protocol/tformat/device.hpp"

namespace absenc::tformat {
namespace {

using testing::Bench;
using testing::PowerOn;
using testing::reset;
using testing::Wire;

TEST(TformatDevice, OverHeatIsLatchedUntilCooledAndCleared) {
  Bench bench;
  bench.condition(temperature, 90);
  EXPECT_EQ(bench.everything().alarms, 0);
  bench.condition(temperature, 91);
  const Reply hot = bench.everything();
  EXPECT_EQ(hot.alarms, alarms::over_heat);
  EXPECT_EQ(hot.status, status::alarm);
  reset(bench, DataId::clear_alarms);
  EXPECT_EQ(bench.everything().alarms, alarms::over_heat);
  bench.condition(temperature, 60);
  EXPECT_EQ(bench.everything().alarms, alarms::over_heat);
  reset(bench, DataId::clear_alarms);
  EXPECT_EQ(bench.everything().alarms, 0);
}

TEST(TformatDevice, CounterContinuesAfterOverflow) {
  Bench bench;
  bench.shaft.put(65535, 5);
  EXPECT_EQ(bench.everything().alarms, 0);
  bench.shaft.put(65536, 5);
  EXPECT_EQ(bench.everything().alarms, alarms::counter_overflow);
  EXPECT_EQ(bench.everything().multiturn, 0u);
  EXPECT_EQ(bench.everything().status, 0);  // the status field (SF) does not show the alarm counter_overflow
  bench.restart();
  EXPECT_EQ(bench.everything().alarms, alarms::counter_overflow);
}

TEST(TformatDevice, FullAbsoluteStatusClearsBelow100Rpm) {
  Bench bench;
  bench.encoder.power_off(bench.line.now());
  bench.shaft.put(0, 0x12345);
  bench.shaft.spin(100, bench.line.now());
  bench.encoder.power_on(bench.line.now(), PowerOn::skip);
  const Reply fast = bench.everything();
  EXPECT_EQ(fast.alarms, alarms::full_absolute_status);
  EXPECT_EQ(fast.singleturn & 0xFFF, 0u);  // only the top 5 bits of the position are valid, the others are 0
  bench.shaft.spin(99, bench.line.now());
  EXPECT_EQ(bench.everything().alarms, 0);
  bench.shaft.spin(3000, bench.line.now());
  EXPECT_EQ(bench.everything().alarms, 0);  // full_absolute_status is raised at power on only
}

TEST(TformatDevice, BatteryFlags) {
  Bench bench;
  bench.shaft.put(9, 0);
  bench.condition(battery_voltage, 3050);
  EXPECT_EQ(bench.everything().alarms, alarms::battery_alarm);
  bench.condition(battery_voltage, 3600);
  EXPECT_EQ(bench.everything().alarms, 0);  // the alarm battery_alarm is not latched
  bench.condition(battery_voltage, 2600);
  // a second power on has no effect, because the encoder is on already
  bench.encoder.power_on(bench.line.now(), PowerOn::skip);
  // The alarm battery_error is raised only if the battery fails while the power is off.
  EXPECT_EQ(bench.everything().alarms, alarms::battery_alarm);
  bench.restart();
  const Reply lost = bench.everything();
  EXPECT_EQ(lost.alarms, alarms::battery_alarm | alarms::battery_error);
  EXPECT_FALSE(to_reading({}, lost).multiturn_valid);
  EXPECT_EQ(lost.multiturn, 0u);  // the turns are lost, because no battery supplied the counter
  bench.condition(battery_voltage, 3600);
  reset(bench, DataId::reset_multiturn);
  EXPECT_EQ(bench.everything().alarms, 0);
}

// Limits of battery_alarm and battery_error in paragraph 6.5: "3.1 V or less", "2.75 V or less".
TEST(TformatDevice, BatteryLimitsBelongToTheFlags) {
  for (const auto& [millivolts, alarm, error] : {std::tuple(3101, false, false),
                                                 {3100, true, false},
                                                 {2751, true, false},
                                                 {2750, true, true},
                                                 {0, true, true}}) {
    Bench bench;
    bench.condition(battery_voltage, millivolts);
    EXPECT_EQ(bench.everything().alarms, alarm ? alarms::battery_alarm : 0) << millivolts;
    bench.restart();
    EXPECT_EQ((bench.everything().alarms & alarms::battery_error) != 0, error) << millivolts;
  }
}

TEST(TformatDevice, ReportsBatteryFailureWhileOff) {
  Bench bench;
  bench.shaft.put(9, 0);
  bench.encoder.power_off(bench.line.now());
  bench.condition(battery_voltage, 0);
  bench.pass(1s);
  bench.condition(battery_voltage, 3600);
  bench.pass(1s);
  bench.encoder.power_on(bench.line.now(), PowerOn::skip);
  EXPECT_EQ(bench.everything().alarms, alarms::battery_error);
  EXPECT_EQ(bench.everything().multiturn, 0u);
  reset(bench, DataId::reset_multiturn);
  bench.restart();
  // no battery alarm is raised, because the battery was connected during the restart
  EXPECT_EQ(bench.everything().alarms, 0);
  // The battery fails while the power is on, so no turns are lost.
  bench.condition(battery_voltage, 0);
  bench.condition(battery_voltage, 3600);
  bench.restart();
  EXPECT_EQ(bench.everything().alarms, 0);
}

// Paragraph 6.5 says the same of the alarm over_heat with a battery and without one.
TEST(TformatDevice, OverHeatIsLatchedWithoutABattery) {
  Bench bench;
  bench.condition(battery_voltage, 0);
  bench.encoder.raise_alarms(alarms::over_heat | alarms::over_speed | alarms::counter_overflow);
  bench.restart();
  EXPECT_EQ(bench.everything().alarms, alarms::over_heat | alarms::battery_error | alarms::battery_alarm);
}

TEST(TformatDevice, WithoutTurnsNoCounterOverflows) {
  testing::TestShaft shaft;
  VirtualEncoder encoder({.multiturn_bits = 0}, shaft);
  encoder.power_on(Time{}, PowerOn::skip);
  const Wire request{0x1A};
  for (const int turns : {1, 5, -3}) {
    shaft.put(turns, 77);
    encoder.feed({.kind = Event<std::uint8_t>::Kind::received, .at = 1s * (10 + turns), .items = request});
    EXPECT_EQ(encoder.everything(1s * (10 + turns)).alarms, 0) << turns;
    encoder.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = 1s * (10 + turns)});
  }
  encoder.power_off(20s);
  shaft.spin(9'000, 20s);
  encoder.power_on(30s, PowerOn::skip);
  EXPECT_EQ(encoder.everything(30s).alarms & alarms::over_speed, 0);
}

TEST(TformatDevice, BatteryFalseMeansNoBattery) {
  testing::TestShaft shaft;
  shaft.put(3, 5);
  VirtualEncoder encoder({.battery = false}, shaft);
  for (std::size_t i = 0; i < conditions.size(); ++i) encoder.set_condition(i, conditions[i].normal, Time{});
  encoder.power_on(Time{}, PowerOn::skip);
  EXPECT_EQ(encoder.everything(Time{}).alarms, alarms::without_battery);
}

TEST(TformatDevice, OverSpeedArisesWhileTheBatteryCounts) {
  Bench bench;
  bench.shaft.spin(6000, bench.line.now());
  bench.encoder.power_off(bench.line.now());
  bench.pass(1s);
  bench.encoder.power_on(bench.line.now(), PowerOn::skip);
  EXPECT_EQ(bench.everything().alarms & alarms::over_speed, 0);
  bench.encoder.power_off(bench.line.now());
  bench.shaft.spin(6100, bench.line.now());
  bench.pass(1s);
  bench.encoder.power_on(bench.line.now(), PowerOn::skip);
  const Reply reply = bench.encoder.everything(bench.line.now());
  EXPECT_EQ(reply.alarms & alarms::over_speed, alarms::over_speed);
  // over_speed made the turn counter miss one turn
  EXPECT_EQ(reply.multiturn, (bench.shaft.at(bench.line.now()).position >> 32) - 1);
}

// For the first five seconds after power off the turn counter follows a higher acceleration (5.4.2).
TEST(TformatDevice, AccelerationLimitFallsFiveSecondsAfterPowerOff) {
  struct Jolt final : Shaft {
    [[nodiscard]] ShaftState at(Time time) const override {
      return {.acceleration = time >= when && time < when + 100ms ? 40'000 : 0};
    }
    Time when{};
  } jolt;
  for (const auto& [when, is_seen] : {std::pair<Time, bool>{4'800ms, false}, {5'100ms, true}}) {
    jolt.when = when;
    VirtualEncoder encoder({}, jolt);
    encoder.power_on(Time{}, PowerOn::skip);
    encoder.power_off(Time{});
    encoder.power_on(10s, PowerOn::skip);
    EXPECT_EQ(encoder.everything(10s).alarms, is_seen ? alarms::over_speed : 0) << when.count();
  }
}

TEST(TformatDevice, CountingAndMultiturnErrorsEndWithThePower) {
  Bench bench;
  bench.encoder.raise_alarms(alarms::counting_error | alarms::multiturn_error | alarms::over_speed);
  EXPECT_EQ(bench.everything().status, status::counting_error | status::alarm);
  bench.restart();
  EXPECT_EQ(bench.everything().alarms, alarms::over_speed);
}

TEST(TformatDevice, IsSilentWhileItStarts) {
  for (const bool battery : {true, false}) {
    Bench bench;
    bench.condition(battery_voltage, battery ? 3600 : 0);
    bench.restart(PowerOn::real);
    const Time start = battery ? 1s : 1500ms;  // time after power on until the encoder answers (5.4)
    testing::RawHost early({0x1A}, start - 1ms);
    EXPECT_TRUE(bench.run(early).reply.empty());
    testing::RawHost late({0x1A}, start);
    ASSERT_EQ(bench.run(late).reply.size(), 11u);
    EXPECT_EQ(late.reply[9], battery ? 0 : alarms::battery_alarm | alarms::battery_error);
  }
}

}  // namespace
}  // namespace absenc::tformat
