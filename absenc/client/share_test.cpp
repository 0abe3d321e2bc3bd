// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/share.hpp"

#include <gtest/gtest.h>

namespace absenc::client {
namespace {

// Computed by hand from Wilson's formula, for 0 of 100 and 10 of 100.
TEST(ShareTest, MatchesWilsonInterval) {
  EXPECT_NEAR((Share{0, 100}).low(), 0, 1e-12);
  EXPECT_NEAR((Share{0, 100}).high(), 0.037, 1e-3);
  EXPECT_NEAR((Share{10, 100}).low(), 0.0552, 1e-3);
  EXPECT_NEAR((Share{10, 100}).high(), 0.1744, 1e-3);
}

}  // namespace
}  // namespace absenc::client
