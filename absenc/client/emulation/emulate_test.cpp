// SPDX-License-Identifier: Apache-2.0
// Tests a virtual encoder on a port. The setting latency=500 allows replies to come half a second late, as on a busy
// computer.
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include <set>

#include "absenc/client/emulate.hpp"
#include "absenc/client/encoder.hpp"
#include "absenc/client/test_support.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {

using testing::HasSubstr;
using testing::Not;
using Kind = Sample::Kind;

namespace {

std::string flag_text(const Unit& unit, const Reading& reading) {
  std::string text;
  for (const Flags& flags : alarms_of(unit, reading)) text += to_text(Value(flags));
  return text;
}

TEST(ClientEmulation, EveryUnitOfALineIsServedAndRead) {
  for (const Unit* unit : all_units()) {
    const bool goes = !host_clocks(unit->link);
    const std::string text = std::string(unit->id);
    if (!goes) {
      EXPECT_THAT(thrown_by<UsageError>([&] { static_cast<void>(emulate(text)); }), HasSubstr("sim:" + text));
      continue;
    }
    const Emulation emulation = emulate(text);
    Encoder encoder = open(emulation.address() + "?latency=500");
    const Reading reading = encoder.read();
    EXPECT_EQ(reading.singleturn, 0u) << text;
    EXPECT_GT(emulation.answer_count(), 0u) << text;
  }
}

TEST(ClientEmulation, AnInterfaceThatIsNotThereSaysSo) {
  EXPECT_THAT(thrown_by<os::Failure>([] { static_cast<void>(emulate("raa38-can", {.can = "nocan7"})); }),
              Not(HasSubstr("nothing was thrown")));
  EXPECT_THAT(thrown_by<UsageError>([] { static_cast<void>(emulate("tformat", {.can = "can0"})); }),
              HasSubstr("does not go over a CAN"));
  EXPECT_THAT(thrown_by<UsageError>([] { static_cast<void>(emulate("raa38-can", {.tcp = 0, .can = "can0"})); }),
              HasSubstr("can0"));
}

TEST(ClientEmulation, WhatIsDoneToItIsSoAtOnce) {
  Emulation emulation = emulate("tformat?singleturn=1000");
  Encoder encoder = open(emulation.address() + "?latency=500");
  EXPECT_EQ(encoder.read().singleturn, 1000u);
  emulation.raise_alarm("over_heat");
  Reading reading = encoder.read();
  EXPECT_EQ(flag_text(emulation.unit(), reading), "over_heat");
  emulation.lower_alarm("over_heat");
  static_cast<void>(encoder.run("clear-alarms"));
  reading = encoder.read();
  EXPECT_EQ(flag_text(emulation.unit(), reading), "");
  emulation.set_condition("temperature", 85);
  EXPECT_EQ(to_text(encoder.run("temperature")["temperature_c"]), "85");
  emulation.power_off();
  EXPECT_EQ(thrown_by<EncoderFailure>([&] { static_cast<void>(encoder.read()); }).substr(0, 7), "timeout");
  emulation.power_on();
  EXPECT_EQ(encoder.read().singleturn, 1000u);
  emulation.set_fault("silence", 1);
  EXPECT_EQ(thrown_by<EncoderFailure>([&] { static_cast<void>(encoder.run("temperature")); }).substr(0, 7), "timeout");
  emulation.clear_faults();
  EXPECT_EQ(to_text(encoder.run("temperature")["temperature_c"]), "85");
  EXPECT_THAT(thrown_by<UsageError>([&] { emulation.set_fault("noise", 1); }), HasSubstr("corrupt"));
  EXPECT_THAT(thrown_by<UsageError>([&] { emulation.set_fault("corrupt", 1.5); }), HasSubstr("from 0 to 1"));
  EXPECT_THAT(thrown_by<UsageError>([&] { emulation.raise_alarm("over_haet"); }), HasSubstr("over_heat"));
  EXPECT_THAT(thrown_by<UsageError>([&] { emulation.set_condition("temprature", 1); }), HasSubstr("temperature"));
  EXPECT_THAT(thrown_by<UsageError>([&] { emulation.set_condition("temperature", 1000); }), HasSubstr("must be"));
}

TEST(ClientEmulation, AnAlarmThatNothingReportsIsRefused) {
  Emulation without = emulate("e201?carries=ssi&singleturn_bits=13");
  EXPECT_THAT(thrown_by<UsageError>([&] { without.raise_alarm("error"); }),
              HasSubstr("the alarm error cannot be shown"));
  without.lower_alarm("error");
  emulate("e201?singleturn_bits=13").raise_alarm("error");
}

TEST(ClientEmulation, APortThatGoesIsWaitedFor) {
  const std::string link = own_path("link");
  std::optional<Emulation> emulation = emulate("tformat?singleturn=7", {.link = link});
  Encoder encoder = open("tformat:" + link);
  std::vector<Kind> kinds;
  for (const Sample& sample : encoder.samples({.rate_hz = 200})) {
    if (kinds.empty() || kinds.back() != sample.kind) kinds.push_back(sample.kind);
    if (sample.kind == Kind::reading && kinds.size() == 1) emulation.reset();
    if (sample.kind == Kind::absent) emulation = emulate("tformat?singleturn=8", {.link = link});
    if (sample.kind == Kind::reading && sample.reading.singleturn == 8) encoder.cancel();
  }
  const std::set<Kind> met(kinds.begin(), kinds.end());
  EXPECT_EQ(met.count(Kind::lost) + met.count(Kind::absent) + met.count(Kind::back), 3u);
  EXPECT_EQ(kinds.back(), Kind::reading);
  EXPECT_EQ(encoder.losses(), 1u);
}

}  // namespace
}  // namespace absenc::client
