// SPDX-License-Identifier: Apache-2.0
#include "absenc/core/bytes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace absenc {
namespace {

constexpr std::array<std::uint8_t, 3> three{1, 2, 3};

TEST(Buffer, RefusesItemsThatDoNotFitAndStoresNone) {
  ByteBuffer<4> buffer;
  EXPECT_TRUE(buffer.empty());
  EXPECT_TRUE(buffer.append(three));
  EXPECT_FALSE(buffer.append(Bytes(three).first(2)));
  EXPECT_EQ(buffer.size(), 3u);
  EXPECT_TRUE(buffer.push_back(4));
  EXPECT_FALSE(buffer.push_back(5));
  EXPECT_TRUE(buffer.append({}));
  EXPECT_TRUE(std::ranges::equal(buffer.view(), std::array{1, 2, 3, 4}));
}

TEST(Buffer, IsEmptyAfterClear) {
  ByteBuffer<4> buffer;
  ASSERT_TRUE(buffer.append(three));
  buffer.clear();
  EXPECT_TRUE(buffer.empty());
  EXPECT_TRUE(buffer.append(Bytes(three).last(2)));
  EXPECT_TRUE(std::ranges::equal(buffer.view(), std::array{2, 3}));
}

constexpr std::size_t used_at_compile_time() {
  Buffer<std::uint32_t, 2> buffer;
  buffer.push_back(7);
  buffer[0] += 1;
  const std::span<const std::uint32_t> view = buffer;
  return view[0];
}
static_assert(used_at_compile_time() == 8);
static_assert(ByteBuffer<11>::capacity() == 11);

}  // namespace
}  // namespace absenc
