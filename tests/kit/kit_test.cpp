// SPDX-License-Identifier: Apache-2.0
// Every unit with everything of the kit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "absenc/protocol/all.hpp"
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

TEST_P(Kit, DecodesItsVectors) {
  const Findings findings = check_decoding(unit);
  EXPECT_GT(findings.looks(), unit.vectors.size());
  expect_none(findings);
}

TEST_P(Kit, HostsTakeWhatVectorsSay) {
  const Findings findings = check_hosts(unit);
  EXPECT_GT(findings.looks(), 100u);
  expect_none(findings);
}

INSTANTIATE_TEST_SUITE_P(Units, Kit, ::testing::ValuesIn(all_units().begin(), all_units().end()),
                         [](const auto& test) { return name_of(*test.param); });

}  // namespace
}  // namespace absenc::kit
