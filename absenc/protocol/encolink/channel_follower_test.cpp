// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/channel_follower.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/encolink/unit.hpp"

namespace absenc::encolink {
namespace {

constexpr Format format{.resolution = 20, .multiturn_bits = 16};
constexpr Position here{.singleturn = 12'345, .multiturn = 7};

struct ComposedFrames {
  std::vector<std::uint8_t> request;
  std::vector<std::uint8_t> reply;
  std::uint64_t first;
  Error error;
};

/// Feeds the follower with the captured exchanges of an encoder at standstill.
struct Conversation {
  /// Adds one exchange. `channel2`: the channel 2 byte of its reply. `at`: the position in its reply.
  void exchange(std::uint8_t config, std::uint8_t ra, std::uint8_t channel2, const Position& at = here) {
    Position position = at;
    position.channel2 = channel2;
    const std::array<std::uint8_t, 2> request{config, ra};
    follower.follow(number++, request, encode_position(format, position));
    take();
  }
  void reset() { exchange(0xAA, 0, 0); }
  /// Adds the exchanges of a whole cycle of channel 2. `ra`: second bytes of the first requests; the others are 0.
  void cycle(std::uint8_t channel3 = channel3::idle, std::uint16_t status = 0, Bytes ra = {}, Position at = here) {
    const ReplyBytes bytes = encode_cycle(format, {at, status, channel3});
    for (std::size_t i = 0; i < bytes.size(); ++i) exchange(0, i < ra.size() ? ra[i] : std::uint8_t{0}, bytes[i]);
  }
  /// Adds as many cycles of channel 2 as the bytes of the register access need.
  void ask(const RegisterRequest& request) {
    for (Bytes left = encode_access(request).view(); !left.empty();) {
      const AccessBytes all = encode_access(request);
      cycle(channel3::idle, 0, all.view().subspan(asked));
      asked += format.cycle_bytes();
      left = all.view().subspan(std::min(asked, all.size()));
    }
    asked = 0;
  }
  void take() {
    Composed one;
    while (follower.take(one)) {
      composed.push_back(
          {{one.request.begin(), one.request.end()}, {one.reply.begin(), one.reply.end()}, one.first, one.error});
    }
  }
  /// Returns the register accesses that the follower found; cycles of channel 2 are left out.
  [[nodiscard]] std::vector<ComposedFrames> accesses() const {
    std::vector<ComposedFrames> all;
    for (const ComposedFrames& one : composed) {
      if (!one.request.empty()) all.push_back(one);
    }
    return all;
  }

  ChannelFollower follower{format};
  std::uint64_t number = 0;
  std::size_t asked = 0;
  std::vector<ComposedFrames> composed;
};

struct Fields final : FieldSink {
  void put(const FieldValue& value) override {
    text += std::string(value.info->name) + "=" + std::to_string(value.number) + " ";
  }
  std::string text;
};

Error decode_as_unit(const ComposedFrames& one, std::string& fields) {
  Options options;
  EXPECT_EQ(resolve_options(unit, {}, {}, options).kind, OptionError::Kind::none);
  Fields sink;
  const Error error = unit.decode(options, {.bytes = one.request}, {.bytes = one.reply}, sink);
  fields = sink.text;
  return error;
}

TEST(EncolinkSpiUnit, DecodesReplyOfRequestThatIsClockedWithZeros) {
  Options options;
  ASSERT_EQ(resolve_options(spi_unit, {}, {}, options).kind, OptionError::Kind::none);
  const auto frame = hex<"E8A6D050DF695A">;
  const auto clocked = hex<"00CD0000000000">;
  Fields reply;
  ASSERT_EQ(spi_unit.decode(options, {.bytes = clocked}, {.bytes = frame}, reply), Error::none);
  EXPECT_THAT(reply.text, ::testing::HasSubstr("singleturn=3413047 multiturn=59558"));
  constexpr std::size_t channel2_bit = 8 * 6;
  EXPECT_TRUE(spi_unit.is_checked(options, {.bytes = clocked}, {.bytes = frame}, channel2_bit - 1));
  EXPECT_FALSE(spi_unit.is_checked(options, {.bytes = clocked}, {.bytes = frame}, channel2_bit));
}

TEST(EncolinkFollower, ComposesCycleFromFrames) {
  Conversation line;
  line.reset();
  line.cycle(channel3::idle, status::temperature);
  line.cycle();
  ASSERT_EQ(line.composed.size(), 2u);
  const ReplyBytes expected = encode_cycle(format, {here, status::temperature, channel3::idle});
  EXPECT_EQ(line.composed[0].reply, std::vector(expected.view().begin(), expected.view().end()));
  EXPECT_EQ(line.composed[0].first, 1u);
  EXPECT_EQ(line.composed[1].first, 10u);
  std::string fields;
  EXPECT_EQ(decode_as_unit(line.composed[0], fields), Error::none);
  EXPECT_NE(fields.find(" alarms=16 "), std::string::npos) << fields;
}

TEST(EncolinkFollower, FindsCycleWithoutResetByChecksumAndPosition) {
  Conversation line;
  for (int i = 0; i < 4; ++i) line.exchange(0, 0, 0x55);
  line.cycle();
  line.cycle();
  ASSERT_EQ(line.composed.size(), 2u);
  EXPECT_EQ(line.composed[0].first, 4u);
  EXPECT_EQ(line.composed[0].error, Error::none);
}

TEST(EncolinkFollower, ReportsCycleWithAnotherPosition) {
  Conversation line;
  Position other = here;
  other.singleturn ^= 1;
  line.cycle(channel3::idle, 0, {}, other);
  EXPECT_TRUE(line.composed.empty()) << "it may be no cycle";
  line.reset();
  line.cycle(channel3::idle, 0, {}, other);
  ASSERT_EQ(line.composed.size(), 1u);
  EXPECT_EQ(line.composed[0].error, Error::cross_check_failed);
}

TEST(EncolinkFollower, FindsNextCycleAfterLostFrame) {
  Conversation line;
  line.reset();
  line.exchange(0, 0, 1);
  line.follower.lose();
  for (int i = 0; i < 3; ++i) line.exchange(0, 0, 0x55);
  EXPECT_TRUE(line.composed.empty());
  line.cycle();
  EXPECT_EQ(line.composed.size(), 1u);
}

TEST(EncolinkFollower, ComposesRegisterReadFromFrames) {
  Conversation line;
  line.reset();
  line.ask(read_request(0x4C, 2));
  for (const std::uint8_t byte : {channel3::busy, channel3::read_ready, std::uint8_t{0x09}, std::uint8_t{0x01}}) {
    line.cycle(byte);
  }
  EXPECT_TRUE(line.accesses().empty()) << "a byte of its data is missing";
  line.cycle(0x5E);
  line.cycle();
  const std::vector<ComposedFrames> composed = line.accesses();
  ASSERT_EQ(composed.size(), 1u);
  EXPECT_EQ(composed[0].reply, (std::vector<std::uint8_t>{0x88, 0x09, 0x01, 0x5E}));
  EXPECT_EQ(composed[0].first, 1u);
  std::string fields;
  EXPECT_EQ(decode_as_unit(composed[0], fields), Error::none);
  EXPECT_NE(fields.find("address=76 "), std::string::npos) << fields;
}

TEST(EncolinkFollower, ComposesRefusedAccessWithReason) {
  for (const bool writes : {false, true}) {
    Conversation line;
    line.reset();
    line.ask(writes ? write_request(0x4C, 2, 1) : read_request(0x4C, 3));
    line.cycle(writes ? channel3::write_ready : channel3::read_ready);
    line.cycle(static_cast<std::uint8_t>(writes ? AccessStatus::denied : AccessStatus::byte_count));
    for (int i = 0; i < 4; ++i) line.cycle(0);  // channel 3 bytes that belong to no register access
    const std::vector<ComposedFrames> composed = line.accesses();
    ASSERT_EQ(composed.size(), 1u);
    std::string fields;
    EXPECT_EQ(decode_as_unit(composed[0], fields), Error::request_rejected);
    Options options;
    EXPECT_EQ(resolve_options(unit, {}, {}, options).kind, OptionError::Kind::none);
    const Explanation why =
        unit.explain(options, Error::request_rejected, {.bytes = composed[0].request}, {.bytes = composed[0].reply});
    EXPECT_EQ(why.detail, text_of(writes ? AccessStatus::denied : AccessStatus::byte_count));
  }
}

TEST(EncolinkFollower, ResetDropsPendingAccess) {
  Conversation line;
  line.reset();
  line.ask(read_request(0x4C, 2));
  line.reset();
  for (const std::uint8_t byte : {channel3::read_ready, std::uint8_t{0x09}, std::uint8_t{1}, std::uint8_t{2}}) {
    line.cycle(byte);
  }
  EXPECT_TRUE(line.accesses().empty());
  EXPECT_EQ(line.composed.size(), 6u);
}

}  // namespace
}  // namespace absenc::encolink
