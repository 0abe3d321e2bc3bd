// SPDX-License-Identifier: Apache-2.0
// Tests the angles of joint and motor, with virtual encoders, and the settings for them.
#include "absenc/client/joint.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "absenc/client/encoder.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/sample_rows.hpp"

namespace absenc::client {
namespace {

TEST(Joint, ComputesAnglesAsDocumented) {
  const Joint joint{.direction = -1, .offset = 30, .gear = 50.0 / 3, .pole_pairs = 7, .is_set = true};
  EXPECT_DOUBLE_EQ(joint_degrees(joint, 30), 0);
  EXPECT_DOUBLE_EQ(joint_degrees(joint, 30 + 360 * 50.0 / 3), -360);
  EXPECT_DOUBLE_EQ(electrical_degrees(joint, 30), 0);
  EXPECT_DOUBLE_EQ(electrical_degrees(joint, 31), 353);
  EXPECT_NEAR(electrical_degrees(joint, 29), 7, 1e-12);
  const Estimate speed = joint_speed(joint, {100, 2});
  EXPECT_DOUBLE_EQ(speed.value, -6);
  EXPECT_DOUBLE_EQ(speed.uncertainty, 0.12);
}

TEST(Joint, ElectricalAngleIsFrom0ToBelow360) {
  for (const int direction : {1, -1}) {
    for (int counts = 0; counts < 1 << 14; ++counts) {
      const double angle = degrees(static_cast<std::uint64_t>(counts), 14);
      for (const double offset : {0.0, angle, 123.456, -1e-15}) {
        const double electrical =
            electrical_degrees({.direction = direction, .offset = offset, .pole_pairs = 11}, angle);
        ASSERT_GE(electrical, 0);
        ASSERT_LT(electrical, 360);
        const double wanted = direction * (angle - offset) * 11;
        ASSERT_NEAR(std::remainder(electrical - wanted, 360), 0, 1e-9);
      }
    }
  }
  const Joint linear{.offset = 5, .pole_pair_mm = 24};
  EXPECT_DOUBLE_EQ(electrical_degrees(linear, 11), 90);
  EXPECT_DOUBLE_EQ(electrical_degrees(linear, -1), 270);
  EXPECT_DOUBLE_EQ(electrical_degrees(linear, 5 + 24 * 1000), 0);
}

void expect_angles(const std::string& address, double direction, double offset, double gear, double pole_pairs) {
  Encoder encoder = open(address);
  double first = 0;
  double last = 0;
  std::size_t wraps = 0;
  double before = -1;
  for (const Sample& sample : encoder.samples({.rate_hz = 500, .count = 400})) {
    ASSERT_EQ(sample.kind, Sample::Kind::reading);
    const double turns = std::ldexp(static_cast<double>(sample.position), -int(sample.reading.singleturn_bits));
    if (before < 0) first = turns;
    last = turns;
    ASSERT_TRUE(sample.angles.joint_deg.has_value()) << address;
    EXPECT_NEAR(*sample.angles.joint_deg, direction * (360 * turns - offset) / gear, 1e-9);
    ASSERT_TRUE(sample.angles.electrical_deg.has_value());
    EXPECT_GE(*sample.angles.electrical_deg, 0);
    EXPECT_LT(*sample.angles.electrical_deg, 360);
    const double electrical = direction * (360 * turns - offset) * pole_pairs;
    EXPECT_NEAR(std::remainder(*sample.angles.electrical_deg - electrical, 360), 0, 1e-6);
    wraps += before >= 0 && std::abs(*sample.angles.electrical_deg - before) > 180 ? 1 : 0;
    before = *sample.angles.electrical_deg;
    if (const std::optional<Estimate> speed = sample.speed_rpm()) {
      ASSERT_TRUE(sample.angles.joint_speed_rpm.has_value());
      EXPECT_DOUBLE_EQ(sample.angles.joint_speed_rpm->value, direction * speed->value / gear);
      EXPECT_DOUBLE_EQ(sample.angles.joint_speed_rpm->uncertainty, speed->uncertainty / gear);
    }
  }
  EXPECT_GT(std::abs(last - first), 3) << "turns";
  EXPECT_GT(wraps, 6u);
}

TEST(Joint, FollowsTheShaftOverSeveralTurnsInBothDirections) {
  const std::string more = "&pole_pairs=5&offset_deg=-40.5&gear=";
  expect_angles("sim:tformat?multiturn=100&motion=rpm=300" + more + "50", 1, -40.5, 50, 5);
  expect_angles("sim:tformat?multiturn=100&motion=rpm=-300&direction=-1" + more + "50/3", -1, -40.5, 50.0 / 3, 5);
  // the shaft turns so far that the encoder's counter of turns passes 0
  expect_angles("sim:tformat?multiturn=1&motion=rpm=-300" + more + "0.5", 1, -40.5, 0.5, 5);
}

TEST(Joint, IsUnknownWithoutTurns) {
  const std::string single = "sim:esl?model=single-turn&singleturn=1000";
  EXPECT_FALSE(open(single + "&gear=2").samples({.count = 1}).begin()->angles.joint_deg.has_value());
  EXPECT_TRUE(open(single + "&gear=1").samples({.count = 1}).begin()->angles.joint_deg.has_value());
  EXPECT_TRUE(open(single + "&gear=2&pole_pairs=3").samples({.count = 1}).begin()->angles.electrical_deg.has_value());
  // The alarm battery_error makes the turns of the encoder invalid.
  const std::string lost = "sim:tformat?multiturn=5&gear=2&alarm=battery_error";
  EXPECT_FALSE(open(lost).samples({.count = 1}).begin()->angles.joint_deg.has_value());
}

TEST(Joint, IsInvalidIfPositionIsInvalid) {
  Encoder encoder = open("sim:tformat?gear=2&pole_pairs=3&alarm=counting_error");
  SampleRows rows(encoder.unit(), encoder.options(), Time{}, SampleRows::With::motion, encoder.joint());
  for (const Sample& sample : encoder.samples({.count = 3})) {
    EXPECT_FALSE(sample.angles.joint_deg.has_value());
    EXPECT_FALSE(sample.angles.electrical_deg.has_value());
    const Row& row = rows.of(sample);
    for (const std::string_view name :
         {"joint_deg", "electrical_deg", "joint_speed_rpm", "joint_speed_uncertainty_rpm"}) {
      EXPECT_EQ(row[name], Value(Invalid{})) << name;
    }
  }
}

TEST(Joint, AddsColumnsAndKeepsPosition) {
  Encoder encoder = open("sim:biss?model=linear-26-1um&singleturn=30000&direction=-1&offset_mm=10&pole_pair_mm=24");
  SampleRows rows(encoder.unit(), encoder.options(), Time{}, SampleRows::With::motion, encoder.joint());
  for (const Sample& sample : encoder.samples({.count = 1})) {
    const Row& row = rows.of(sample);
    EXPECT_EQ(row.get<double>("position_mm"), 30);
    EXPECT_EQ(row.get<std::uint64_t>("singleturn"), 30000u);
    EXPECT_EQ(row.get<double>("joint_mm"), -20);
    EXPECT_NEAR(row.get<double>("electrical_deg"), 60, 1e-9);
  }
  Encoder plain = open("sim:tformat");
  const SampleRows without(plain.unit(), plain.options(), Time{}, SampleRows::With::motion, plain.joint());
  for (const Column& column : without.columns()) {
    EXPECT_EQ(column.name.find("joint"), std::string_view::npos);
    EXPECT_EQ(column.name.find("electrical"), std::string_view::npos);
  }
}

TEST(Joint, RefusesInvalidSettings) {
  const auto refused = [](const std::string& address) -> std::string {
    try {
      static_cast<void>(parse_address(address));
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  };
  for (const std::string_view setting :
       {"gear=0", "gear=-2", "gear=1/0", "gear=a", "gear=", "gear=1/2/3", "gear=nan", "gear=inf", "pole_pairs=0",
        "pole_pairs=2.5", "direction=0", "direction=2", "offset_deg=x", "offset_deg=nan"}) {
    const std::string name(setting.substr(0, setting.find('=')));
    EXPECT_NE(refused("sim:tformat?" + std::string(setting)).find(name + " is "), std::string::npos) << setting;
  }
  const std::string linear = "sim:biss?model=linear-26-1um&";
  EXPECT_NE(refused(linear + "gear=2").find("has no gear ratio"), std::string::npos);
  EXPECT_NE(refused(linear + "pole_pairs=2").find("pole_pair_mm"), std::string::npos);
  EXPECT_NE(refused(linear + "offset_deg=2").find("offset_mm"), std::string::npos);
  EXPECT_NE(refused("sim:tformat?offset_mm=2").find("offset_deg"), std::string::npos);
  EXPECT_NE(refused("sim:tformat?pole_pair_mm=2").find("pole_pairs"), std::string::npos);
  EXPECT_EQ(refused("sim:tformat?gear=50/3&pole_pairs=7&direction=-1&offset_deg=-12.5"), "");
  EXPECT_EQ(refused(linear + "pole_pair_mm=24&direction=-1&offset_mm=5"), "");
}

}  // namespace
}  // namespace absenc::client
