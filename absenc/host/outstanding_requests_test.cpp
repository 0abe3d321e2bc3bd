// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/outstanding_requests.hpp"

#include <gtest/gtest.h>

#include <array>

namespace absenc::host {
namespace {

using namespace std::chrono_literals;

TEST(OutstandingRequests, KnowsTheLongestIntervalBetweenRequests) {
  constexpr std::array<std::uint8_t, 1> request{0x02};
  OutstandingRequests<std::uint8_t> requests;
  requests.add(request, 6, 100ms);
  EXPECT_EQ(requests.longest_interval(103ms), 3ms) << "the time since the last request counts";
  requests.add(request, 6, 110ms);
  EXPECT_EQ(requests.longest_interval(111ms), 10ms);
  EXPECT_EQ(requests.longest_interval(150ms), 40ms);
  requests.clear();
  requests.add(request, 6, 200ms);
  EXPECT_EQ(requests.longest_interval(204ms), 4ms) << "it begins again with an empty list";
}

}  // namespace
}  // namespace absenc::host
