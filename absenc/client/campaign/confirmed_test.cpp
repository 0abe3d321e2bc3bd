// SPDX-License-Identifier: Apache-2.0
// Compares confirmed positions on a bad line with the true ones, for every model.
#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <string>
#include <vector>

#include "absenc/client/campaign.hpp"
#include "absenc/protocol/all.hpp"
#include "tests/cases.hpp"

namespace absenc::client {
namespace {

struct Encoder {
  std::string unit;
  std::string model;  // name of the model, or ""
};

void PrintTo(const Encoder& encoder, std::ostream* out) { *out << encoder.unit << " " << encoder.model; }

std::vector<Encoder> encoders() {
  std::vector<Encoder> all;
  for (const Unit* unit : all_units()) {
    for (const Model& model : unit->models) all.push_back({std::string(unit->id), std::string(model.name)});
    if (unit->models.empty()) all.push_back({std::string(unit->id), {}});
  }
  return all;
}

std::string name_of(const ::testing::TestParamInfo<Encoder>& info) {
  std::string name = info.param.unit + "_" + info.param.model;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
}

class Confirmed : public ::testing::TestWithParam<Encoder> {
 protected:
  static CampaignResult read(double damaged, double rpm, std::uint32_t maximum_rpm = 0) {
    CampaignChoices choices{.model = GetParam().model, .exchanges = test_cases(2000)};
    choices.faults = {"corrupt=" + std::to_string(damaged)};
    choices.rpm = rpm;
    choices.maximum_rpm = maximum_rpm;
    return campaign(GetParam().unit, choices);
  }

  // Returns by how much the counted number of wrong confirmed positions may exceed the computed number: four standard
  // deviations, and two more for very small numbers.
  static double chance(const Guarded& guarded) { return 4 * std::sqrt(guarded.let_through) + 2; }
};

TEST_P(Confirmed, IsNotWrongMoreOftenThanChecksAndLimitLetThrough) {
  for (const double rpm : {0.0, 60.0, 1000.0}) {
    for (const double damaged : {0.01, 0.1, 1.0}) {
      SCOPED_TRACE(std::to_string(rpm) + " rpm, damaged " + std::to_string(damaged));
      const CampaignResult result = read(damaged, rpm);
      const Guarded& guarded = *result.guarded;
      const auto wrong = static_cast<double>(guarded.wrong.count);
      EXPECT_LE(wrong, guarded.let_through + chance(guarded)) << guarded.alone.count << " were wrong";
      EXPECT_GE(result.damaged, static_cast<std::uint64_t>(damaged * static_cast<double>(result.exchanges) / 4));
      if (damaged == 1.0) continue;
      EXPECT_GE(wrong, guarded.let_through - chance(guarded)) << "what is computed is too much";
      EXPECT_GT(guarded.confirmed.high(), 0.97) << "and the right ones are confirmed";
    }
  }
}

TEST_P(Confirmed, IsWrongLessOftenWithALowerLimit) {
  const Guarded usual = *read(0.1, 60).guarded;
  const Guarded lower = *read(0.1, 60, 100).guarded;
  EXPECT_LE(static_cast<double>(lower.wrong.count), lower.let_through + chance(lower));
  EXPECT_LE(lower.let_through, usual.let_through + chance(usual));
  EXPECT_GT(lower.confirmed.high(), 0.97);
}

INSTANTIATE_TEST_SUITE_P(Models, Confirmed, ::testing::ValuesIn(encoders()), name_of);

// The words of SSI have no checksum: only a position that is too far from the one before shows damage.
TEST(ConfirmedWords, WithoutACheckOnlyTheLimitTells) {
  CampaignChoices choices{.faults = {"corrupt=0.1"}, .exchanges = 20'000};
  choices.rpm = 0;
  choices.maximum_rpm = 1;
  const CampaignResult result = campaign("ssi", choices);
  const Guarded& guarded = *result.guarded;
  std::printf("%.3g of the words wrong, %.3g of the confirmed ones, computed %.3g\n", guarded.alone.rate(),
              guarded.wrong.rate(), guarded.let_through / static_cast<double>(guarded.confirmed.count));
  EXPECT_GT(guarded.alone.rate(), 0.05);
  EXPECT_LT(guarded.wrong.rate(), guarded.alone.rate() / 2);
  EXPECT_NEAR(static_cast<double>(guarded.wrong.count), guarded.let_through, 5 * std::sqrt(guarded.let_through));
}

}  // namespace
}  // namespace absenc::client
