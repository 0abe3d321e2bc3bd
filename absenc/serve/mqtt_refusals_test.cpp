// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/mqtt_refusals.hpp"

#include <gtest/gtest.h>

namespace absenc::serve {

namespace {

using namespace std::chrono_literals;
using Verdict = MqttRefusals::Verdict;

}  // namespace

TEST(MqttRefusals, DoublesPauseOfRefusedTopicAndSendsOthers) {
  MqttRefusals refusals;
  EXPECT_TRUE(refusals.refuse("a", "why", 0s));
  EXPECT_EQ(refusals.verdict("b", 5, 0s), Verdict::send);
  Time now = 0s;
  for (const Time pause : {2s, 4s, 8s, 16s, 32s, 60s, 60s}) {
    EXPECT_EQ(refusals.verdict("a", 0, now + pause - 1ms), Verdict::skip);
    EXPECT_FALSE(refusals.take_due(now + pause - 1ms));
    now += pause;
    EXPECT_TRUE(refusals.take_due(now));
    EXPECT_EQ(refusals.verdict("a", 5, now), Verdict::send);
    refusals.sent("a");
    EXPECT_EQ(refusals.verdict("a", 5, now), Verdict::skip) << "one at a time";
    EXPECT_FALSE(refusals.refuse("a", "why", now)) << "not new";
  }
  EXPECT_TRUE(refusals.take_due(now + 60s));
  refusals.sent("a");
  EXPECT_TRUE(refusals.take("a"));
  EXPECT_EQ(refusals.verdict("a", 5, now), Verdict::send);
  EXPECT_EQ(refusals.text(), "");
}

TEST(MqttRefusals, ReportsNewReason) {
  MqttRefusals refusals;
  EXPECT_TRUE(refusals.refuse("a", "why", 0s));
  EXPECT_FALSE(refusals.refuse("a", "why", 0s));
  EXPECT_TRUE(refusals.refuse("a", "another", 0s));
}

TEST(MqttRefusals, FindsTopicThatMakesBrokerCloseConnection) {
  MqttRefusals refusals;
  EXPECT_EQ(refusals.end_connection({"a", "b", "c"}, true, 0s), "");
  refusals.begin_connection();
  EXPECT_EQ(refusals.verdict("a", 2, 0s), Verdict::send) << "one lost connection proves nothing";
  EXPECT_EQ(refusals.end_connection({"a", "b", "c"}, true, 1s), "");
  refusals.begin_connection();
  EXPECT_EQ(refusals.verdict("a", 1, 1s), Verdict::wait);
  EXPECT_EQ(refusals.verdict("a", 0, 1s), Verdict::send);
  refusals.sent("a");
  EXPECT_EQ(refusals.verdict("d", 1, 1s), Verdict::wait) << "a suspect is sent alone";
  EXPECT_FALSE(refusals.take("a"));
  refusals.sent("b");
  EXPECT_EQ(refusals.end_connection({"b"}, true, 2s), "b");
  refusals.begin_connection();
  EXPECT_EQ(refusals.verdict("b", 0, 2s), Verdict::skip);
  EXPECT_EQ(refusals.verdict("a", 3, 2s), Verdict::send);
  EXPECT_TRUE(refusals.take_due(4s));
  EXPECT_EQ(refusals.verdict("b", 1, 4s), Verdict::wait) << "it may close the connection for other topics";
}

}  // namespace absenc::serve
