// SPDX-License-Identifier: Apache-2.0
// Tests of captures of Nikon's A-format in which a host reads the alarms after a position.
#include "absenc/protocol/nikon/status_follower.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

namespace absenc::nikon {
namespace {

using Wire = std::vector<std::uint8_t>;

Wire wire(const auto& bytes) { return {bytes.view().begin(), bytes.view().end()}; }

constexpr OneReply alarmed{.address = 2, .status = 1, .data = 77};
constexpr OneReply battery{.address = 2, .status = 1, .data = alarm::battery};

/// Feeds the follower with captured exchanges.
struct Conversation {
  explicit Conversation(const Format& format = {}) : follower(format) {}

  void exchange(const Request& request, const OneReply& reply) {
    follow(encode_request({}, request), encode_reply(request.code, reply));
  }
  void follow(Bytes request, Bytes reply) {
    follower.follow(number++, request, reply);
    Composed one;
    composed.reset();
    if (follower.take(one)) {
      composed = Wire(one.request.begin(), one.request.end());
      composed_reply = Wire(one.reply.begin(), one.reply.end());
      first = one.first;
    }
  }
  void position(const OneReply& reply = alarmed, Code code = Code::position) {
    exchange({.code = code, .address = reply.address}, reply);
  }
  void alarms(const OneReply& reply = battery) { exchange({.code = Code::alarms, .address = reply.address}, reply); }

  StatusFollower follower;
  std::uint64_t number = 5;
  std::optional<Wire> composed;  // request of the last composed frame; no value if there is none
  Wire composed_reply;
  std::uint64_t first = 0;
};

TEST(NikonFollower, AlarmsBelongToThePositionBeforeThem) {
  Conversation seen;
  seen.position();
  EXPECT_FALSE(seen.composed);
  seen.alarms();
  ASSERT_TRUE(seen.composed);
  EXPECT_EQ(seen.first, 5u);
  const Result<Request> asked = decode_captured({}, *seen.composed);
  ASSERT_TRUE(asked);
  EXPECT_TRUE(asked->with_status);
  EXPECT_EQ(asked->address, 2);
  EXPECT_FALSE(decode_request({}, *seen.composed)) << "an encoder has no such request";
  const Result<Reply> answered = decode_reply({}, *asked, seen.composed_reply);
  ASSERT_TRUE(answered);
  EXPECT_EQ(answered->data, 77u);
  EXPECT_EQ(answered->alarms_read, alarm::battery);
  seen.alarms();
  EXPECT_FALSE(seen.composed) << "they are told once";
}

TEST(NikonFollower, OnlyTheNextExchangeCounts) {
  Conversation seen;
  seen.alarms();
  EXPECT_FALSE(seen.composed);
  seen.position();
  seen.position();
  EXPECT_FALSE(seen.composed);
  seen.alarms();
  EXPECT_TRUE(seen.composed);
  EXPECT_EQ(seen.first, 7u);
  seen.position();
  seen.follower.lose();
  seen.alarms();
  EXPECT_FALSE(seen.composed);
  seen.position();
  ++seen.number;
  seen.alarms();
  EXPECT_FALSE(seen.composed) << "an exchange is missing";
}

TEST(NikonFollower, AnotherEncoderIsNotMeant) {
  Conversation seen;
  seen.position();
  seen.alarms({.address = 3, .status = 1, .data = alarm::battery});
  EXPECT_FALSE(seen.composed);
}

TEST(NikonFollower, RepliesOfSeveralEncodersAreNotComposed) {
  const Request asked{.code = Code::all_short_positions, .address = 7};
  Wire replies;
  for (const std::uint8_t address : {std::uint8_t{2}, std::uint8_t{5}}) {
    const auto one = encode_reply(asked.code, {.address = address, .status = 1});
    replies.insert(replies.end(), one.view().begin(), one.view().end());
  }
  Conversation seen({.singleturn_bits = short_bits});
  seen.follow(encode_request({}, asked), replies);
  seen.alarms();
  EXPECT_FALSE(seen.composed);
}

TEST(NikonFollower, DamagedExchangesAreNotComposed) {
  Wire request = wire(encode_request({}, {.code = Code::position, .address = 2}));
  Wire reply = wire(encode_reply(Code::position, alarmed));
  for (Wire* const damaged : {&request, &reply}) {
    Conversation seen;
    damaged->back() ^= 0x20;
    seen.follow(request, reply);
    damaged->back() ^= 0x20;
    seen.alarms();
    EXPECT_FALSE(seen.composed);
  }
}

TEST(NikonFollower, RepliesWithAlarmsNeedNoOthers) {
  for (const Code code : {Code::with_alarms, Code::alarms, Code::temperature}) {
    Conversation seen;
    seen.position(alarmed, code);
    seen.alarms();
    EXPECT_FALSE(seen.composed) << static_cast<int>(code);
  }
}

TEST(NikonFrame, CapturedRequestsAreTwoAtMost) {
  const RequestBytes position = encode_request({}, {.code = Code::position, .address = 2});
  const RequestBytes alarms = encode_request({}, {.code = Code::alarms, .address = 2});
  const auto decode = [](std::initializer_list<Bytes> parts) {
    Wire both;
    for (const Bytes part : parts) both.insert(both.end(), part.begin(), part.end());
    return decode_captured({}, both);
  };
  EXPECT_TRUE(decode({position, alarms}));
  EXPECT_FALSE(decode({position}).value().with_status);
  EXPECT_EQ(decode({position, position}).error(), Error::wrong_length);
  EXPECT_FALSE(decode({position, alarms, alarms}));
}

TEST(NikonFrame, BothRepliesOfACaptureAreChecked) {
  const Request asked{.code = Code::position, .address = 2, .with_status = true, .status_address = 2};
  const auto joined = [&](const OneReply& second) {
    const auto one = encode_reply(Code::position, alarmed);
    const auto two = encode_reply(Code::alarms, second);
    Wire both(one.view().begin(), one.view().end());
    both.insert(both.end(), two.view().begin(), two.view().end());
    return both;
  };
  Wire bytes = joined(battery);
  EXPECT_TRUE(decode_reply({}, asked, bytes));
  bytes.back() ^= 1;
  EXPECT_EQ(decode_reply({}, asked, bytes).error(), Error::bad_checksum);
  bytes = joined(battery);
  bytes[2] ^= 1;
  EXPECT_EQ(decode_reply({}, asked, bytes).error(), Error::bad_checksum);
  EXPECT_EQ(decode_reply({}, asked, Bytes(bytes).first(4)).error(), Error::wrong_length);
  EXPECT_FALSE(decode_reply({}, asked, joined({.address = 3})));
  Request other = asked;
  other.status_address = 3;
  EXPECT_EQ(decode_reply({}, other, joined(battery)).error(), Error::unexpected_reply) << "encoder 3 was asked";
}

TEST(NikonFrame, AlarmsOfACaptureBelongToOneEncoder) {
  const Request asked{.code = Code::all_positions, .address = 7, .with_status = true, .status_address = 2};
  Wire bytes;
  for (const std::uint8_t address : {std::uint8_t{2}, std::uint8_t{5}}) {
    const auto one = encode_reply(Code::all_positions, {.address = address, .status = 1});
    bytes.insert(bytes.end(), one.view().begin(), one.view().end());
  }
  const auto alarms = encode_reply(Code::alarms, battery);
  bytes.insert(bytes.end(), alarms.view().begin(), alarms.view().end());
  EXPECT_EQ(decode_reply({}, asked, bytes).error(), Error::unexpected_reply);
}

}  // namespace
}  // namespace absenc::nikon
