// SPDX-License-Identifier: Apache-2.0
// Tests of alarms and resets of the virtual QS35 against its document (Table 8), with single requests.
#include <gtest/gtest.h>

#include "absenc/protocol/esl/bench_test.hpp"
#include "absenc/protocol/esl/device.hpp"

namespace absenc::esl {
namespace {

using testing::Bench;

TEST(EslDevice, AlarmsAreClearedAsInTable8) {
  struct Row {
    std::uint8_t alarm;
    bool by_c;
    bool by_d_and_c;
    bool by_power;
  };
  for (const Row& row :
       {Row{alarms::xc_error, true, true, false}, Row{alarms::multiturn_error, false, true, false},
        Row{alarms::led_or_lissajous_error, false, false, true}, Row{alarms::overspeed, false, false, true},
        Row{alarms::memory_error, false, false, true}, Row{alarms::singleturn_error, false, false, true},
        Row{alarms::under_voltage, false, false, false}, Row{alarms::over_voltage, false, false, false}}) {
    Bench bench;
    bench.encoder.raise_alarms(row.alarm);
    EXPECT_EQ(bench.read().one.alarms, row.alarm);
    EXPECT_EQ(bench.read().two.alarms, row.alarm);
    bench.reset(DataId::clear_alarms, 7);
    EXPECT_EQ(bench.read().one.alarms, row.alarm);
    bench.reset(DataId::clear_alarms);
    EXPECT_EQ(bench.read().one.alarms == 0, row.by_c) << int{row.alarm};
    bench.reset(DataId::reset_multiturn);
    bench.pass(10ms);
    bench.reset(DataId::clear_alarms);
    EXPECT_EQ(bench.read().one.alarms == 0, row.by_d_and_c) << int{row.alarm};
    if (row.by_c || row.by_d_and_c) continue;
    bench.restart();
    EXPECT_EQ(bench.read().one.alarms == 0, row.by_power) << int{row.alarm};
    bench.encoder.lower_alarms(row.alarm);
    EXPECT_EQ(bench.read().one.alarms, 0);
  }
}

// Table 8 on clearing the alarm multiturn_error: "perform MT counter reset and all error clear".
TEST(EslDevice, ClearsMultiturnErrorOnlyAfterItsTurnReset) {
  Bench bench;
  bench.reset(DataId::reset_multiturn);
  bench.pass(10ms);
  bench.encoder.raise_alarms(alarms::multiturn_error);
  bench.reset(DataId::clear_alarms);
  EXPECT_EQ(bench.read().one.alarms, alarms::multiturn_error);
  bench.reset(DataId::reset_multiturn);
  bench.pass(10ms);
  // The alarm multiturn_error was raised already when the turns were reset, so raising it again here changes nothing.
  bench.encoder.raise_alarms(alarms::multiturn_error);
  bench.reset(DataId::clear_alarms);
  EXPECT_EQ(bench.read().one.alarms, 0);
}

TEST(EslDevice, PowerCycleLeavesTurnAlarms) {
  Bench bench;
  bench.encoder.raise_alarms(alarms::turns_wrong | alarms::overspeed | alarms::memory_error);
  for (unsigned i = 0; i < 5; ++i) bench.read();
  bench.restart();
  const Reply reply = bench.read();
  EXPECT_EQ(reply.one.alarms, alarms::turns_wrong);
  EXPECT_EQ(reply.one.sequence, 1);
}

TEST(EslDevice, SupplySpeedAndTemperature) {
  Bench bench;
  for (const auto& [index, value, alarms, status] :
       {std::tuple{condition::supply_voltage, 2900, 0, status::ready + 0},
        std::tuple{condition::supply_voltage, 2899, alarms::under_voltage + 0, status::ready | status::safety_error},
        std::tuple{condition::supply_voltage, 3700, 0, status::ready + 0},
        std::tuple{condition::supply_voltage, 3701, alarms::over_voltage + 0, status::ready | status::safety_error},
        std::tuple{condition::temperature, 105, 0, status::ready + 0},
        std::tuple{condition::temperature, 106, 0, status::ready | status::temperature_warning}}) {
    bench.condition(index, value);
    EXPECT_EQ(bench.read().one.alarms, alarms) << value;
    EXPECT_EQ(bench.read().one.status, status) << value;
    bench.condition(index, conditions[index].normal);
  }
  bench.condition(condition::temperature, -10);
  EXPECT_EQ(bench.run("temperature").numbers.at("temperature_c"), -10);
  bench.shaft.spin(10'000, bench.line.now());
  EXPECT_EQ(bench.read(DataId::alarms).one.alarms, 0);
  bench.shaft.spin(-10'001, bench.line.now());
  bench.read(DataId::alarms);
  bench.shaft.spin(0, bench.line.now());
  EXPECT_EQ(bench.read(DataId::alarms).one.alarms, alarms::overspeed);
  EXPECT_EQ(bench.read(DataId::alarms).one.status, status::ready | status::non_safety_error);
}

// ---- Resets

TEST(EslDevice, OtherOrTooFastRequestRestartsTheCount) {
  Bench bench;
  bench.shaft.put(3, 1'000'000);
  bench.reset(DataId::zero, 7);
  bench.raw(Request{DataId::temperature});
  bench.reset(DataId::zero, 1);
  EXPECT_EQ(bench.read().singleturn, 1'000'000u);
  // these eight requests of a reset follow each other after less than 35 us
  for (unsigned i = 0; i < 8; ++i) bench.raw(Request{DataId::zero});
  EXPECT_EQ(bench.read().singleturn, 1'000'000u);
  EXPECT_GT(bench.violations(), 0u);
  bench.reset(DataId::zero);
  EXPECT_EQ(bench.read().singleturn, 0u);
  EXPECT_EQ(bench.read().redundant, 0u);
  EXPECT_EQ(bench.read().multiturn, 3u);
}

TEST(EslDevice, ResetOnATurningShaftIsAViolation) {
  Bench bench;
  bench.shaft.spin(5, Time{});
  bench.reset(DataId::reset_multiturn);
  ASSERT_EQ(bench.violations(), 1u);
  EXPECT_EQ(bench.encoder.violations()[0].rule, "reset while the shaft turns");
}

}  // namespace
}  // namespace absenc::esl
