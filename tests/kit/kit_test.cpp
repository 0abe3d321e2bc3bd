// SPDX-License-Identifier: Apache-2.0
// Runs every check of the kit on every unit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "absenc/protocol/all.hpp"
#include "tests/cases.hpp"
#include "tests/kit/kit.hpp"

namespace absenc::kit {
namespace {

std::string name_of(const Unit& unit) {
  std::string name(unit.id);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

void expect_none(const Findings& findings) {
  for (const std::string& text : findings.texts()) ADD_FAILURE() << text;
  EXPECT_EQ(findings.count(), 0u);
  for (const std::string& note : findings.notes()) std::printf("%s\n", note.c_str());
}

class Kit : public ::testing::TestWithParam<const Unit*> {
 protected:
  const Unit& unit = *GetParam();
};

TEST_P(Kit, DecodesVectors) {
  const Findings findings = check_decoding(unit);
  EXPECT_GT(findings.check_count(), unit.vectors.size());
  expect_none(findings);
}

TEST_P(Kit, BitPositionsGiveFieldValues) {
  const Findings findings = check_places(unit);
  EXPECT_EQ(findings.check_count() > 100, unit.bits != nullptr);
  expect_none(findings);
}

TEST_P(Kit, HostsReadVectorReplies) {
  const Findings findings = check_hosts(unit);
  EXPECT_GT(findings.check_count(), 100u);
  expect_none(findings);
}

TEST_P(Kit, SilenceEndsWithTimeout) {
  const Findings findings = check_silence(unit);
  EXPECT_EQ(findings.check_count() > 1, !host_clocks(unit.link));
  expect_none(findings);
}

TEST_P(Kit, CommandsSucceedOnGoodLine) {
  const Findings findings = check_commands(unit);
  EXPECT_GT(findings.check_count(), 10u);
  expect_none(findings);
}

TEST_P(Kit, AlarmsHaveThreeStates) {
  const Findings findings = check_states(unit);
  EXPECT_EQ(findings.check_count() > 20, unit.alarms != nullptr) << findings.check_count();
  expect_none(findings);
}

TEST_P(Kit, CommandsRunBesideCycles) {
  const Findings findings = check_cycles(unit);
  EXPECT_GT(findings.check_count(), 4u);
  expect_none(findings);
}

TEST_P(Kit, CyclesFollowTurningShaft) {
  const Findings findings = check_turning(unit);
  EXPECT_GT(findings.check_count(), 4u);
  expect_none(findings);
}

TEST_P(Kit, DeclarationsNameExistingCommands) { expect_none(check_declarations(unit)); }
TEST_P(Kit, RequestsContainTheirArguments) { expect_none(check_requests(unit, 1)); }
TEST_P(Kit, DeclaredStorageSuffices) { expect_none(check_storage(unit)); }
TEST_P(Kit, SettingsReadBackAsWritten) { expect_none(check_settings(unit)); }
TEST_P(Kit, ConditionsAreVisibleToHost) { expect_none(check_conditions(unit)); }
TEST_P(Kit, AdviceCanBeFollowed) {
  const Findings findings = check_advice(unit);
  EXPECT_GT(findings.check_count(), 50u);
  expect_none(findings);
}
TEST_P(Kit, ZeroIsRefusedForInvalidPosition) { expect_none(check_zero(unit)); }
TEST_P(Kit, MemoryReadsBackAsWritten) { expect_none(check_memory(unit)); }

/// Parameters of a test of `check_exchanges`: the number of the fault series and the unit.
using Series = std::tuple<unsigned, const Unit*>;

class KitExchanges : public ::testing::TestWithParam<Series> {};

TEST_P(KitExchanges, RejectsWrongResults) {
  const auto [series, unit] = GetParam();
  expect_none(check_exchanges(*unit, {.count = test_cases(125'000), .seed = series}));
}

class KitDamagedRequests : public KitExchanges {};

TEST_P(KitDamagedRequests, RejectsWrongResults) {
  const auto [series, unit] = GetParam();
  expect_none(check_exchanges(*unit, {.count = 10'000, .seed = series, .requests_too = true}));
}

const auto name_of_series = [](const auto& test) {
  return std::to_string(std::get<0>(test.param)) + "_" + name_of(*std::get<1>(test.param));
};

INSTANTIATE_TEST_SUITE_P(Seeds, KitExchanges,
                         ::testing::Combine(::testing::Range(0u, 6u),
                                            ::testing::ValuesIn(all_units().begin(), all_units().end())),
                         name_of_series);

// Returns all units except those on CAN, whose own checksum detects damage.
std::vector<const Unit*> units_of_bytes() {
  std::vector<const Unit*> units(all_units().begin(), all_units().end());
  std::erase_if(units, [](const Unit* unit) { return unit->link == LinkKind::can; });
  return units;
}

INSTANTIATE_TEST_SUITE_P(Seeds, KitDamagedRequests,
                         ::testing::Combine(::testing::Range(0u, 2u), ::testing::ValuesIn(units_of_bytes())),
                         name_of_series);

INSTANTIATE_TEST_SUITE_P(Units, Kit, ::testing::ValuesIn(all_units().begin(), all_units().end()),
                         [](const auto& test) { return name_of(*test.param); });

}  // namespace
}  // namespace absenc::kit
