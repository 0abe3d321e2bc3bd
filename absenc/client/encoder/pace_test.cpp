// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/encoder/pace.hpp"

#include <gtest/gtest.h>

namespace absenc::client {
namespace {

using namespace std::chrono_literals;

TEST(Pace, WhatWasDueBeforeTheEndIsMissedWhereverItCame) {
  const Time start = os::now() - 10s;
  Pace pace(10);
  pace.start_at(start);
  pace.leave_out(start + 550ms);  // at 550 ms, times were due at 0, 100, 200, 300, 400 and 500 ms
  EXPECT_EQ(pace.take_missed(), 6u);
  pace.leave_out(start + 550ms);
  EXPECT_EQ(pace.take_missed(), 0u) << "once";
}

TEST(Pace, WithoutARateNothingIsDue) {
  Pace pace(0);
  pace.start_at(os::now() - 10s);
  pace.leave_out(os::now());
  EXPECT_EQ(pace.take_missed(), 0u);
}

TEST(Pace, WhatIsNotDueYetIsNotMissed) {
  Pace pace(0.01);
  pace.start_at(os::now() - 1s);
  pace.leave_out(never);
  EXPECT_EQ(pace.take_missed(), 0u) << "late";
  pace.start_at(os::now() + 10s);
  pace.leave_out(never);
  EXPECT_EQ(pace.take_missed(), 0u);
}

}  // namespace
}  // namespace absenc::client
