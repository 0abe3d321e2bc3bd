// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/serial/frame.hpp"

#include <gtest/gtest.h>

#include <array>

namespace absenc::raa38::serial {
namespace {

static_assert(Format{.bits = 16}.data_bytes() == 2 && Format{.bits = 17}.data_bytes() == 3);
static_assert(encode_position({.bits = 14}, {383})[4] == 0x00, "the sum of 3.1.1 is 200 hex");

TEST(Raa38SerialFrame, FirstFailingCheckGivesError) {
  const auto error = [](std::initializer_list<std::uint8_t> bytes, int unit = any_unit) {
    return decode_position({.bits = 14}, {bytes.begin(), bytes.size()}, unit).error();
  };
  EXPECT_EQ(error({0xFF, 0x81, 0x40, 0x00}), Error::wrong_length);
  EXPECT_EQ(error({0xFE, 0x80, 0x40, 0x00, 0x00}), Error::bad_checksum);
  EXPECT_EQ(error({0xFE, 0x81, 0x40, 0x00, 0xBF}), Error::unexpected_reply);
  EXPECT_EQ(error({0xFF, 0x81, 0x40, 0x00, 0xC0}), Error::out_of_range);
  EXPECT_EQ(error({0xFF, 0xB2, 0x01, 0x7F, 0x31}, 1), Error::unexpected_reply);
  EXPECT_EQ(error({0xFF, 0xB2, 0x01, 0x7F, 0x31}, 2), Error::none);
  EXPECT_EQ(error({0xFF, 0xB2, 0x01, 0x7F, 0x31}), Error::none);
}

// A stream that repeats one frame may contain a second FF 81; decoded from there, it must give the same position or an
// error.
TEST(Raa38SerialFrame, RepeatedFrameHasNoOtherAlignment) {
  for (const unsigned bits : {10u, 14u, 16u, 17u, 21u}) {
    const Format format{.bits = bits};
    const std::size_t size = format.frame_bytes();
    for (std::uint64_t value = 0; value <= low_mask(bits); ++value) {
      const FrameBytes frame = encode_position(format, {static_cast<std::uint32_t>(value)});
      std::array<std::uint8_t, 2 * frame_capacity> twice{};
      for (std::size_t i = 0; i < 2 * size; ++i) twice[i] = frame[i % size];
      for (std::size_t offset = 1; offset < size; ++offset) {
        if (twice[offset] != header || twice[offset + 1] != fixed_second_byte) continue;
        const Result<Position> other = decode_position(format, Bytes(twice).subspan(offset, size));
        ASSERT_TRUE(!other || other->singleturn == value) << bits << " bits, " << value;
      }
    }
  }
}

TEST(Raa38SerialFrame, ChecksEveryByteOfARequest) {
  const RequestBytes good = encode_request({Request::Kind::read, 3});
  ASSERT_TRUE(decode_request(good).has_value());
  for (std::size_t i = 0; i < good.size(); ++i) {
    RequestBytes wrong = good;
    wrong[i] = static_cast<std::uint8_t>(wrong[i] ^ 0x10);
    EXPECT_EQ(decode_request(wrong).error(), Error::unexpected_reply) << i;
  }
}

}  // namespace
}  // namespace absenc::raa38::serial
