// SPDX-License-Identifier: Apache-2.0
// Tests of the counter for requests in a row.
#include "absenc/protocol/author/in_a_row.hpp"

#include <gtest/gtest.h>

#include <string>

namespace absenc::author {
namespace {

using namespace std::chrono_literals;

constexpr InARow row{.requests = 3, .interval = 40us, .accepted = 40us, .number_rule = "three", .interval_rule = "40"};

struct Counted : RuleWatch {
  void looked(std::string_view rule, bool kept) override {
    log += rule;
    log += kept ? "+ " : "- ";
  }
  Counted() { rules.watch(this); }

  std::string log;
  HostRules rules;
  RowCounter counter{row, rules};
};

TEST(RowCounter, ExecutesAfterTheDemandedNumberAndAgainAfterThatManyMore) {
  Counted one;
  for (int i = 1; i <= 6; ++i) EXPECT_EQ(one.counter.count(7, i * 50us, i * 50us), i % 3 == 0) << i;
  EXPECT_EQ(one.rules.violation_count(), 0u);
}

TEST(RowCounter, RequestThatComesTooSoonIsTheFirstOfANewRow) {
  Counted one;
  EXPECT_FALSE(one.counter.count(7, 50us, 50us));
  EXPECT_FALSE(one.counter.count(7, 100us, 100us));
  EXPECT_FALSE(one.counter.count(7, 139us, 139us));
  EXPECT_EQ(one.rules.violation_count(), 1u);
  EXPECT_FALSE(one.counter.count(7, 179us, 179us));
  EXPECT_TRUE(one.counter.count(7, 219us, 219us));
}

TEST(RowCounter, OtherCodeOrOtherRequestBeginsANewRow) {
  Counted one;
  EXPECT_FALSE(one.counter.count(7, 50us, 50us));
  EXPECT_FALSE(one.counter.count(7, 100us, 100us));
  EXPECT_FALSE(one.counter.count(8, 150us, 150us));
  EXPECT_FALSE(one.counter.count(8, 200us, 200us));
  one.counter.end();
  EXPECT_FALSE(one.counter.count(8, 250us, 250us));
  EXPECT_EQ(one.log, "40+ three- 40+ three- ");
}

TEST(RowCounter, ForgottenRowBreaksNoRule) {
  Counted one;
  EXPECT_FALSE(one.counter.count(7, 50us, 50us));
  EXPECT_FALSE(one.counter.count(7, 100us, 100us));
  one.counter.forget();
  EXPECT_FALSE(one.counter.count(7, 101us, 101us));
  EXPECT_EQ(one.log, "40+ ");
}

TEST(RowCounter, MeasuresFromTheEarliestArrivalOrTheReply) {
  Counted one;
  EXPECT_FALSE(one.counter.count(7, 60us, 50us));
  EXPECT_FALSE(one.counter.count(7, 90us, 90us));
  EXPECT_EQ(one.rules.violation_count(), 0u);
  one.counter.measure_from(120us);
  EXPECT_FALSE(one.counter.count(7, 159us, 159us));
  EXPECT_EQ(one.rules.violation_count(), 1u);
}

}  // namespace
}  // namespace absenc::author
