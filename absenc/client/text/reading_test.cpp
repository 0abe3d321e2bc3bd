// SPDX-License-Identifier: Apache-2.0
// Checks that values, rows, CSV and JSON show the three states of alarms and of validity.
#include "absenc/client/reading.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "absenc/client/reading_columns.hpp"
#include "absenc/client/row.hpp"
#include "absenc/client/text/row_text.hpp"

namespace absenc::client {
namespace {

constexpr std::array<FlagInfo, 3> flags{{{"hot", "", "cool it"}, {"", "", ""}, {"dirty", "", "", true}}};
constexpr std::array<FieldInfo, 4> fields{{
    {"one_alarms", FieldInfo::Kind::flags, "", "", flags},
    {"two_alarms", FieldInfo::Kind::flags, "", "", flags},
    {"place", FieldInfo::Kind::counts, "counts", "", {}, Role::position},
    {"turns", FieldInfo::Kind::counts, "revolutions", "", {}, Role::turns},
}};

Unit toy(unsigned channels) {
  Unit unit{};
  unit.fields = fields;
  unit.alarms = &fields[0];
  if (channels == 2) unit.second_alarms = &fields[1];
  unit.resolution = [](const Options&) -> Resolution { return {.singleturn_bits = 12, .multiturn_bits = 4}; };
  return unit;
}

Reading reading(std::uint32_t alarms, std::uint32_t reported) {
  return {.singleturn = 1024,
          .multiturn = 3,
          .singleturn_bits = 12,
          .multiturn_bits = 4,
          .singleturn_valid_bits = 12,
          .multiturn_valid = true,
          .alarms = alarms,
          .alarms_reported = reported};
}

std::string json_of(const Unit& unit, const Reading& one) {
  const ReadingColumns columns(unit, {});
  std::vector<Value> values(columns.columns().size());
  columns.fill(one, values);
  return to_json(Row{columns.columns(), std::move(values)}).line();
}

std::string csv_of(const Unit& unit, const Reading& one) {
  const ReadingColumns columns(unit, {});
  std::vector<Value> values(columns.columns().size());
  columns.fill(one, values);
  return to_csv(Row{columns.columns(), std::move(values)});
}

TEST(ClientReading, FlagsAreCompleteWhereAllThatAreNotOptionalAreReported) {
  EXPECT_FALSE((Flags{&fields[0], 0, 0}.is_complete()));
  EXPECT_FALSE((Flags{&fields[0], 0, 4}.is_complete()));
  EXPECT_TRUE((Flags{&fields[0], 0, 1}.is_complete()));
  EXPECT_TRUE((Flags{&fields[0], 0}.is_complete())) << "a field that is there";
}

TEST(ClientReading, AlarmsAreRaisedClearOrUnknown) {
  const Unit unit = toy(1);
  const auto value = [&](std::uint32_t alarms, std::uint32_t reported) {
    return value_of(*joined_alarms(unit, reading(alarms, reported)));
  };
  EXPECT_EQ(value(0, 0), Value(Unknown{}));
  EXPECT_EQ(value(0, 4), Value(Unknown{}));
  EXPECT_EQ(value(0, 5), Value(Flags{&fields[0], 0, 5}));
  EXPECT_EQ(value(4, 4), Value(Flags{&fields[0], 4, 4})) << "what is raised counts, whatever else is not reported";
  EXPECT_EQ(joined_alarms(Unit{}, {}), std::nullopt);
}

TEST(ClientReading, TwoChannelsAreClearOnlyTogether) {
  const Unit unit = toy(2);
  const Reading half = reading(0, 5);
  EXPECT_EQ(alarms_of(unit, half)[0].reported, 5u);
  EXPECT_EQ(alarms_of(unit, half)[1].reported, 0u);
  EXPECT_EQ(value_of(*joined_alarms(unit, half)), Value(Unknown{}));
  EXPECT_EQ(value_of(*joined_alarms(unit, reading(0, 5 | 5 << 3))), Value(Flags{&fields[0], 0, 5}));
  EXPECT_EQ(joined_alarms(unit, reading(1 << 3, 5 << 3))->bits, 1u);
}

TEST(ClientReading, RowsTellClearFromNotReported) {
  const Unit unit = toy(1);
  EXPECT_NE(json_of(unit, reading(0, 0)).find("\"alarms\":null"), std::string::npos);
  EXPECT_NE(json_of(unit, reading(0, 5)).find("\"alarms\":[]"), std::string::npos);
  EXPECT_NE(json_of(unit, reading(1, 5)).find("\"alarms\":[\"hot\"]"), std::string::npos);
  EXPECT_EQ(csv_of(unit, reading(0, 0)), "90,1024,true,3,true,,");
  EXPECT_EQ(csv_of(unit, reading(0, 5)), "90,1024,true,3,true,,none");
  EXPECT_EQ(csv_of(unit, reading(5, 5)), "90,1024,true,3,true,,hot dirty");
}

TEST(ClientReading, RowsTellInvalidFromUnknown) {
  const Unit unit = toy(1);
  Reading one = reading(0, 5);
  one.singleturn_valid_bits = 0;
  one.multiturn_valid = false;
  EXPECT_EQ(csv_of(unit, one), ",1024,false,3,false,,none");
  one.singleturn_known = one.multiturn_known = false;
  EXPECT_EQ(csv_of(unit, one), ",1024,,3,,,none");
  const std::string json = json_of(unit, one);
  EXPECT_NE(json.find("\"angle_deg\":null"), std::string::npos);
  EXPECT_NE(json.find("\"singleturn_valid\":null"), std::string::npos);
  EXPECT_NE(json.find("\"multiturn_valid\":null"), std::string::npos);
  one.ready = false;
  EXPECT_EQ(csv_of(unit, one), ",1024,false,3,,,none") << "it says that it is starting";
}

TEST(ClientReading, AnswersTellInvalidFromUnknown) {
  AnswerSink sink;
  sink.put({.info = &fields[2], .number = 1024});
  sink.put({.info = &fields[3], .number = 3});
  Reading one = reading(0, 0);
  one.singleturn_valid_bits = 0;
  one.multiturn_valid = one.multiturn_known = false;
  sink.put_reading(one);
  EXPECT_EQ(sink.answer["place"], Value(Invalid{}));
  EXPECT_EQ(sink.answer["turns"], Value(Unknown{}));
}

// Turns that the encoder reports as invalid stay invalid.
TEST(ClientReading, AnUnconfirmedPositionIsUnknown) {
  const Reading unconfirmed = checked(reading(0, 5), false);
  EXPECT_EQ(unconfirmed.singleturn_validity(), Validity::unknown);
  EXPECT_EQ(unconfirmed.multiturn_validity(), Validity::unknown);
  EXPECT_EQ(checked(reading(0, 5), true).singleturn_validity(), Validity::valid);
  Reading lost = reading(0, 5);
  lost.multiturn_valid = false;
  EXPECT_EQ(checked(lost, false).multiturn_validity(), Validity::invalid);
  lost.singleturn_valid_bits = 0;
  EXPECT_EQ(checked(lost, false).singleturn_validity(), Validity::invalid);
}

}  // namespace
}  // namespace absenc::client
