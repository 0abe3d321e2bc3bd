// SPDX-License-Identifier: Apache-2.0
#include "absenc/core/text.hpp"

#include <gtest/gtest.h>

namespace absenc {
namespace {

TEST(Text, IsCutWithinItsEnds) {
  EXPECT_EQ(index_of("a:b:c", ':'), 1u);
  EXPECT_EQ(index_of("abc", ':'), 3u);
  EXPECT_EQ(index_of("", ':'), 0u);
  EXPECT_EQ(first_of("abc", 2), "ab");
  EXPECT_EQ(first_of("abc", 9), "abc");
  EXPECT_EQ(behind("abc", 2), "c");
  EXPECT_EQ(behind("abc", 3), "");
  EXPECT_EQ(behind("abc", 9), "");
}

}  // namespace
}  // namespace absenc
