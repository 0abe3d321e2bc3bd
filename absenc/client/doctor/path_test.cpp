// SPDX-License-Identifier: Apache-2.0
// Checks that doctor's first finding for a fault is an expected one.
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "absenc/client/doctor/path_faults_test.hpp"
#include "absenc/client/error.hpp"

namespace absenc::client::path_faults {
namespace {

class DoctorWays : public ::testing::TestWithParam<const Unit*> {
 protected:
  static std::string sentences(const Examination& examination) {
    std::string text = examination.verdict();
    for (const Finding& one : examination.findings) text += "\n" + one.sentence();
    return text;
  }

  /// Checks, at each baud rate of the unit, that doctor's first finding about each of these faults is an expected one.
  void examine_each(const std::vector<PathFault>& faults) const {
    const Unit& unit = *GetParam();
    const std::string mode = asked_mode(unit);
    for (const std::string& rate : rates_of(unit)) {
      for (const PathFault& fault : faults) {
        SCOPED_TRACE(fmt::format("{} {} {}: {}", unit.id, mode, rate, fault.name));
        const std::optional<Outcome> outcome = fault.examine(unit, mode, rate);
        if (!outcome) continue;
        EXPECT_TRUE(outcome->causes.contains(outcome->seen.first()))
            << fmt::format("with the fault \"{}\" doctor finds {} first, not {}; {} replies changed\n{}", fault.name,
                           outcome->seen.first(), fmt::join(outcome->causes, " or "), outcome->seen.changed,
                           sentences(outcome->seen.examination));
      }
    }
  }
};

TEST_P(DoctorWays, FaultOfBytesIsNamed) { examine_each(faults_of_bytes()); }
TEST_P(DoctorWays, FaultOfLineIsNamed) { examine_each(faults_of_line()); }
TEST_P(DoctorWays, OtherEncoderIsNamed) { examine_each(faults_of_others()); }
TEST_P(DoctorWays, StateIsNamed) { examine_each(faults_of_state()); }

TEST_P(DoctorWays, OtherModelIsNamedInBothDirections) {
  const Unit& unit = *GetParam();
  const std::string mode = asked_mode(unit);
  if (has_weak_check(pair_of(unit, mode, ""))) GTEST_SKIP() << "its check tells too little";
  for (const std::string& said : models_of(unit)) {
    for (const std::string& there : models_of(unit)) {
      if (said == there) continue;
      SCOPED_TRACE(fmt::format("{}: {} read as {}", unit.id, there, said));
      Pair pair = pair_of(unit, said, mode, {});
      pair.far = pair_of(unit, there, mode, {"motion=rpm=20"}).far;
      const Seen seen = examined(pair.asked, pair.far);
      // If both models have the same frames, all readings are good, so doctor has nothing to report.
      const bool is_same = seen.examination.good == seen.examination.tried;
      if (is_same) continue;
      EXPECT_EQ(seen.first(), "wrong_settings") << sentences(seen.examination);
    }
  }
}

/// If the first reading fails, the finding in its error message must be doctor's first finding or one of the unspecific
/// ones in `open`.
TEST_P(DoctorWays, ReadSaysTheSameOrLeavesItOpen) {
  static const Ids open{"no_answer", "always_damaged", "extra_bytes", "bytes_missing", "sometimes_damaged"};
  const Unit& unit = *GetParam();
  for (const PathFault& fault : all_path_faults()) {
    const std::optional<Outcome> outcome = fault.examine(unit, asked_mode(unit), rates_of(unit).front());
    if (!outcome || outcome->seen.read_alone.empty()) continue;
    SCOPED_TRACE(fmt::format("{}: {}", unit.id, fault.name));
    EXPECT_TRUE(open.contains(outcome->seen.read_alone) || outcome->seen.read_alone == outcome->seen.first())
        << "read: " << outcome->seen.read_alone << ", doctor: " << outcome->seen.first();
  }
}

std::string name_of_test(const ::testing::TestParamInfo<const Unit*>& one) {
  std::string name(one.param->id);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Units, DoctorWays, ::testing::ValuesIn(character_units()), name_of_test);

// Doctor compares a setting with the user's by 10 readings with each. At 2400 baud, 5 of these readings take 0.7 s.
TEST(Doctor, SlowLineHasTimeForEachReadingOfComparison) {
  Pair pair = pair_of(*find_unit("raa38-modbus"), "", "baud=2400", {"address=1"});
  pair.far.delay = 35ms;
  const Seen seen = examined(pair.asked + "&address=2", pair.far);
  ASSERT_EQ(seen.first(), "wrong_address");
  EXPECT_NE(seen.examination.first()->evidence.find("10 of 10 with address=1"), std::string::npos)
      << seen.examination.first()->evidence;
}

// The shaft turns slowly: the first 32 of 200 positions are small enough for a resolution of 13 bits, although the
// encoder has 16 bits.
TEST(Doctor, OtherSettingsFitTheLastFramesToo) {
  Pair pair = pair_of(*find_unit("raa38-modbus"), "", "baud=19200", {"bits=16", "singleturn=1100", "motion=rpm=14"});
  pair.far.goes_on = true;
  Opener opener(pair.far);
  const EncoderAddress asked = parse_address(pair.asked + "&bits=10");
  Observations observed;
  while (observed.readings.size() < 200) observed.readings.push_back(read_once(asked, opener));
  const Examination found = judge(*asked.unit, asked.options, observed);
  ASSERT_NE(found.first(), nullptr);
  EXPECT_EQ(found.first()->id, "wrong_settings");
  EXPECT_NE(found.first()->action.find("bits=16"), std::string::npos) << found.first()->action;
}

}  // namespace
}  // namespace absenc::client::path_faults
