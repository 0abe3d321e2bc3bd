// SPDX-License-Identifier: Apache-2.0
// Checks the results of campaigns, and that wrong arguments are refused.
#include "absenc/client/campaign.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "absenc/client/campaign/check_code.hpp"
#include "absenc/client/error.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {
namespace {

CampaignResult run(const std::string& protocol, const std::vector<std::string>& faults,
                   std::uint64_t exchanges = 100'000) {
  return campaign(protocol, {.faults = faults, .exchanges = exchanges, .seed = 3});
}

struct Named {
  const char* protocol;
  const char* fault;
  unsigned check_bits;
  unsigned distance;
};
void PrintTo(const Named& named, std::ostream* out) { *out << named.protocol << " " << named.fault; }

class Computed : public ::testing::TestWithParam<Named> {};

// Checks that the rate of wrong positions is the computed one within five standard deviations.
TEST_P(Computed, IsWhatIsCounted) {
  const Named& named = GetParam();
  const CampaignResult result = run(named.protocol, {named.fault}, 200'000);
  ASSERT_TRUE(result.worth);
  const CheckWorth& worth = *result.worth;
  EXPECT_EQ(worth.check_bits, named.check_bits);
  EXPECT_EQ(worth.distance, named.distance);
  const auto of = static_cast<double>(result.wrong.of);
  const double deviation = std::hypot(std::sqrt(worth.taken / of), worth.taken_deviation);
  std::printf("%s %s: %.3g counted, %.3g computed, deviation %.2g\n", named.protocol, named.fault, result.wrong.rate(),
              worth.taken, deviation);
  EXPECT_NEAR(result.wrong.rate(), worth.taken, 5 * deviation);
  EXPECT_GE(result.wrong.count, 50u);
  EXPECT_EQ(result.older.count, 0u);
}

INSTANTIATE_TEST_SUITE_P(Units, Computed,
                         ::testing::Values(Named{"tformat", "bit=0.01", 8, 2}, Named{"tformat", "bit=0.003", 8, 2},
                                           Named{"tformat", "bit=0.05", 8, 2}, Named{"amt21", "bit=0.01", 2, 2},
                                           Named{"amt21", "bit=0.1", 2, 2}, Named{"ssi", "bit=0.01", 0, 1},
                                           Named{"biss", "bit=0.005", 6, 3}, Named{"biss", "bit=0.02", 6, 3}));

// An XOR checksum misses two wrong bits at the same bit number of two bytes (a column), and detects every error of
// three bits.
TEST(CheckCodeTest, ExclusiveOrHasTheWeightsOfItsColumns) {
  const Unit& unit = *find_unit("tformat");
  Options options;
  ASSERT_EQ(resolve_options(unit, {}, {}, options).kind, OptionError::Kind::none);
  const GoodReply reply{{0x1A}, {0x1A, 0x20, 0x45, 0x23, 0x01, 0x11, 0x34, 0x12, 0x00, 0x10, 0x7A}};
  const auto code = CheckCode::learn(unit, options, std::vector{reply});
  ASSERT_TRUE(code);
  EXPECT_EQ(code->bits(), 88u);
  const std::vector<double> words = code->weights(4);
  EXPECT_EQ(words, (std::vector<double>{1, 0, 8 * 55, 0, 8 * 330 + 28 * 55 * 55}));
  // An XOR checksum misses an error if each of the 8 bit numbers (columns) has an even number of wrong bits.
  const double even = (1 + std::pow(1 - 2 * 0.02, 11)) / 2;
  EXPECT_NEAR(code->unseen(0.02), std::pow(even, 8) - std::pow(0.98, 88), 1e-12);
}

TEST(CampaignTest, KnowsOtherChecks) {
  const CampaignResult modbus = run("raa38-modbus", {"bit=0.01"}, 1000);
  ASSERT_TRUE(modbus.worth);
  EXPECT_EQ(modbus.worth->check_bits, 16u);
  EXPECT_EQ(modbus.worth->distance, 4u);
  const CampaignResult biss = run("biss", {"bit=0.01"}, 1000);
  ASSERT_TRUE(biss.worth);
  EXPECT_EQ(biss.worth->check_bits, 6u);
  EXPECT_EQ(biss.worth->distance, 3u);
  EXPECT_FALSE(run("raa38-can", {"bit=0.01"}, 1000).worth);
}

TEST(CampaignTest, AGoodLineFailsNowhere) {
  for (const Unit* unit : all_units()) {
    const CampaignResult result = run(std::string(unit->id), {"bit=0"}, 3000);
    EXPECT_EQ(result.failed.count, 0u) << unit->id;
    EXPECT_EQ(result.wrong.count, 0u) << unit->id;
    EXPECT_GE(result.exchanges, 3000u) << unit->id;
  }
}

TEST(CampaignTest, EveryFaultIsThere) {
  for (const LineFault& fault : line_faults()) {
    const CampaignResult result = run("tformat", {std::string(fault.name) + "=0.1"}, 20'000);
    const bool harmless =
        fault.name == "delay";  // a reply that comes 200 us later arrives within the timeout, or is dropped as late
    EXPECT_GT(result.failed.count, harmless ? 0u : 500u) << fault.name;
    EXPECT_EQ(result.older.count, 0u) << fault.name;
    EXPECT_LT(result.failed.count, result.exchanges) << fault.name;
  }
}

// A host accepts delayed unsolicited frames: they do not show when they were sent.
TEST(CampaignTest, OldFramesAreCounted) {
  const CampaignResult result = run("raa38", {"late=0.1"}, 20'000);
  EXPECT_GT(result.older.count, 0u);
  EXPECT_LE(result.older.count, result.wrong.count);
}

TEST(CampaignTest, EncodersThatWereChangedAreReplaced) {
  const CampaignResult result = run("raa38-can", {"request_corrupt=0.05"}, 100'000);
  EXPECT_GT(result.changed.count, 0u);
  EXPECT_LT(result.wrong.count, result.exchanges / 100);
  EXPECT_LT(result.given_up.count, result.readings / 10);
}

TEST(CampaignTest, TheSameSeedGivesTheSame) {
  const CampaignResult one = run("biss", {"bit=0.01"}, 5000);
  const CampaignResult other = run("biss", {"bit=0.01"}, 5000);
  EXPECT_EQ(one.failed.count, other.failed.count);
  EXPECT_EQ(one.wrong.count, other.wrong.count);
  EXPECT_NE(one.failed.count, campaign("biss", {.faults = {"bit=0.01"}, .exchanges = 5000, .seed = 4}).failed.count);
}

TEST(CampaignTest, TellsWhatCannotBe) {
  EXPECT_THROW((void)run("tformat", {"bits=0.1"}), UsageError);
  EXPECT_THROW((void)run("tformat", {"bit=2"}), UsageError);
  EXPECT_THROW((void)run("tformat", {"bit=0.1x"}), UsageError);
  EXPECT_THROW((void)run("tformatt", {}), UsageError);
}

}  // namespace
}  // namespace absenc::client
