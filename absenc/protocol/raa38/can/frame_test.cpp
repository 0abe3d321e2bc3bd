// SPDX-License-Identifier: Apache-2.0
// Tests of invalid and unexpected frames, and of more requests than the virtual node can answer.
#include "absenc/protocol/raa38/can/frame.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/raa38/can/bench_test.hpp"

namespace absenc::raa38::can {
namespace {

CanFrame with(CanFrame frame, bool CanFrame::*flag) {
  frame.*flag = true;
  return frame;
}

TEST(Raa38CanFrame, DecodesPositionOnlyFromNode) {
  const CanFrame position = encode_position(0x20, 5);
  EXPECT_EQ(*decode_position({}, position), 5u);
  EXPECT_EQ(decode_position({}, with(position, &CanFrame::extended)).error(), Error::unexpected_reply);
  CanFrame sent = position;
  sent.id = 0x220;
  EXPECT_EQ(decode_position({}, sent).error(), Error::unexpected_reply);
}

TEST(Raa38CanFrame, ChecksAnswersToSettingsOnly) {
  EXPECT_EQ(check_configuration_answer(Order::node, encode_configuration_answer(0x7E5, Order::node, 0)), Error::none);
  EXPECT_EQ(check_configuration_answer(Order::zero, encode_answer(0x20, Order::zero)), Error::unexpected_reply);
}

TEST(Raa38CanFrame, RejectsInvalidRequests) {
  const CanFrame read = encode(Order::read, 0x20);
  EXPECT_TRUE(decode({}, &read, nullptr).has_value());
  EXPECT_EQ(decode({}, nullptr, nullptr).error(), Error::wrong_length);
  const CanFrame remote = with(read, &CanFrame::remote);
  EXPECT_EQ(decode({}, &remote, nullptr).error(), Error::bad_framing);
  CanFrame more = read;
  more.data[7] = 1;
  EXPECT_EQ(decode({}, &more, nullptr).error(), Error::out_of_range);
}

TEST(Raa38CanFrame, DoesNotDecodeCanopenFramesAsPosition) {
  const CanFrame start{.id = 0, .size = 2, .data = {1, 0x20}};
  EXPECT_TRUE(decode({}, nullptr, &start).has_value());
  const CanFrame remote = with(start, &CanFrame::remote);
  EXPECT_EQ(decode({}, nullptr, &remote).error(), Error::bad_framing);
  const CanFrame service{.id = 0x601, .size = 8, .data = {0x80}};
  const CanFrame position = encode_position(1, 5);
  EXPECT_EQ(decode({}, &service, &position).error(), Error::unexpected_reply);
}

TEST(Raa38CanFrame, ExplainsNothingForUnknownOrder) {
  const CanFrame unknown{.id = 0x7E5, .size = 8, .data = {0xFF}};
  EXPECT_EQ(decode({}, nullptr, &unknown).error(), Error::unexpected_reply);
  EXPECT_EQ(explain({}, Error::timeout, {}, {}).detail, "");
  EXPECT_EQ(explain({}, Error::out_of_range, {}, std::array{unknown}).advice, "");
  EXPECT_NE(explain({}, Error::out_of_range, {}, std::array{encode_position(1, 1 << 20)}).advice, "");
}

TEST(Raa38CanDevice, ReportsMoreRequestsThanItCanAnswer) {
  testing::Bench bench(testing::quiet);
  const std::array asked{encode(Order::read, 0x20)};
  for (unsigned i = 0; i < 9; ++i) {
    EXPECT_EQ(bench.encoder().violation_count(), 0u);
    bench.encoder().feed({.kind = Event<CanFrame>::Kind::received, .at = Time(i + 1), .items = asked});
  }
  ASSERT_EQ(bench.encoder().violation_count(), 1u);
  EXPECT_EQ(bench.encoder().violations()[0].rule, "more requests than it can keep answers for");
}

}  // namespace
}  // namespace absenc::raa38::can
