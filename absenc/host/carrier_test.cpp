// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/carrier.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "absenc/protocol/tformat/host.hpp"

namespace absenc::host {
namespace {

using namespace std::chrono_literals;

constexpr auto reply = std::to_array<std::uint8_t>({0x1A, 0x00, 0x45, 0x23, 0x01, 0x11, 0x34, 0x12, 0x00, 0x00, 0x4A});

struct Line {
  std::vector<std::uint8_t> sent{};
  unsigned results = 0;

  void begin(const ByteStep& step) { sent.assign(step.out.begin(), step.out.end()); }
  void result(bool over) { results += over ? 1 : 0; }
};

struct CarrierTest : testing::Test {
  Line line;
  Carrier<std::uint8_t, Line> carrier{line, 1ms};
  tformat::ReadPosition read{tformat::Format{}};
};

TEST_F(CarrierTest, CarriesAConversationByteByByte) {
  carrier.start(read, 5us);
  EXPECT_EQ(line.sent, std::vector<std::uint8_t>{0x1A});
  EXPECT_EQ(carrier.due(), never);  // nothing is due until the line reports that the transfer was sent
  carrier.sent(10us);
  EXPECT_EQ(carrier.due(), 10us + tformat::answer_limit + 1ms);
  Time now = 20us;
  for (const std::uint8_t& byte : reply) carrier.received({&byte, 1}, now += 4us);
  EXPECT_FALSE(carrier.is_busy());
  EXPECT_EQ(line.results, 1u);
  ASSERT_NE(read.reading(), nullptr);
  EXPECT_EQ(read.reading()->singleturn, 0x12345u);
  EXPECT_EQ(read.reading()->latched, 10us);
  EXPECT_EQ(carrier.silences(), 0u);
}

// A machine that lists as text the items, line errors and silences that it receives.
struct Fed final : Machine<std::uint8_t> {
  void feed(const ByteEvent& event) override {
    if (event.kind == ByteEvent::Kind::sent) receiving = true;
    if (event.kind == ByteEvent::Kind::received) {
      all += std::to_string(event.items.size()) + " at " + std::to_string(event.at.count()) + "; ";
      due -= std::min(due, event.items.size());
    }
    if (event.kind == ByteEvent::Kind::line_error) all += "error; ";
    if (event.kind == ByteEvent::Kind::silence) all += "silence; ";
  }
  ByteStep next(Time) override {
    if (!asked) {
      asked = true;
      return {.kind = ByteStep::Kind::transfer, .out = reply, .expect = due};
    }
    if (receiving && due == 0) return {.kind = ByteStep::Kind::done};
    return {.expect = receiving ? due : 0, .at = never, .answer = 1us, .gap = gap};
  }
  bool asked = false, receiving = false;
  std::size_t due = 5;
  Time gap = 1us;
  std::string all{};
};

// A machine whose request has three frames of two bytes, 10 us apart.
struct Frames final : Machine<std::uint8_t> {
  void feed(const ByteEvent& event) override { sent_at = event.kind == ByteEvent::Kind::sent ? event.at : never; }
  ByteStep next(Time) override {
    if (std::exchange(asked, true)) return {.at = never, .answer = 1us};
    return {.kind = ByteStep::Kind::transfer, .frame = 2, .out = bytes, .at = begin, .width = 10us};
  }
  std::array<std::uint8_t, 6> bytes{1, 2, 3, 4, 5, 6};
  Time begin{};
  bool asked = false;
  Time sent_at = never;
};

TEST_F(CarrierTest, SendsFramesOfARequestWithTheirPauses) {
  for (const Time begin : {Time{}, Time(20us)}) {
    Frames frames;
    frames.begin = begin;
    carrier.start(frames, 1us);
    if (begin != Time{}) carrier.tick(begin);
    EXPECT_EQ(line.sent, (std::vector<std::uint8_t>{1, 2}));
    carrier.sent(30us);
    EXPECT_EQ(carrier.due(), 40us);
    carrier.tick(39us);
    EXPECT_EQ(line.sent, (std::vector<std::uint8_t>{1, 2}));
    carrier.tick(40us);
    EXPECT_EQ(line.sent, (std::vector<std::uint8_t>{3, 4}));
    carrier.sent(50us);
    carrier.tick(60us);
    EXPECT_EQ(line.sent, (std::vector<std::uint8_t>{5, 6}));
    EXPECT_EQ(frames.sent_at, never);
    carrier.sent(70us);
    EXPECT_EQ(frames.sent_at, 70us);
  }
}

TEST_F(CarrierTest, DeliversCharactersWhenAllExpectedOnesArrived) {
  const auto fed_by = [](const auto& play, Time gap = 1us, std::size_t due = 5) {
    Line out;
    Carrier<std::uint8_t, Line> carried{out};
    Fed fed;
    fed.gap = gap;
    fed.due = due;
    carried.start(fed, 0ns);
    play(carried);
    return fed.all;
  };
  const auto characters = [](auto& carried, unsigned count, Time first) {
    for (unsigned i = 0; i < count; ++i) carried.received(std::span(reply).first(1), first + i * 1ns);
  };
  EXPECT_EQ(fed_by([&](auto& one) {
              one.sent(10ns);
              characters(one, 4, 11ns);
              EXPECT_EQ(one.due(), 14ns + 1us);
              characters(one, 2, 15ns);  // the sixth character arrives after the conversation has ended and is dropped
            }),
            "5 at 15; ");
  EXPECT_EQ(fed_by([&](auto& one) {
              one.sent(10ns);
              characters(one, 3, 11ns);
              one.tick(20ns);  // `tick` has nothing to do at this time
              one.tick(2us);
            }),
            "3 at 13; silence; ");
  EXPECT_EQ(fed_by([&](auto& one) {
              one.sent(10ns);
              characters(one, 2, 11ns);
              one.line_error(13ns);
              one.received(std::span(reply).first(2), 15ns);
            }),
            "2 at 12; error; 2 at 15; ");
  EXPECT_EQ(fed_by([&](auto& one) {
              characters(one, 1, 5ns);  // one character arrives at 5 ns, before the request is sent at 10 ns
              one.sent(10ns);
              characters(one, 2, 11ns);
              one.received(std::span(reply).first(3), 15ns);
            }),
            "1 at 5; 2 at 12; 3 at 15; ");
  EXPECT_EQ(fed_by(
                [&](auto& one) {
                  one.sent(10ns);
                  characters(one, 2, 11ns);
                },
                0us),
            "1 at 11; 1 at 12; ");  // without a gap limit characters are not gathered: no silence would deliver them
  EXPECT_EQ(fed_by(
                [&](auto& one) {
                  one.sent(10ns);
                  characters(one, 20, 11ns);
                },
                1us, 20),
            "16 at 26; 4 at 30; ");
}

// The next conversation receives no characters that were gathered for an abandoned conversation.
TEST_F(CarrierTest, DropsGatheredCharactersOfAbandonedConversation) {
  Fed fed;
  carrier.start(fed, 0us);
  carrier.sent(1us);
  carrier.received(std::span(reply).first(1), 2us);
  carrier.start(read, 5us);
  carrier.sent(10us);
  Time now = 20us;
  for (const std::uint8_t& byte : reply) carrier.received({&byte, 1}, now += 4us);
  ASSERT_NE(read.reading(), nullptr);
  EXPECT_EQ(read.reading()->received, now);
  EXPECT_EQ(fed.all, "");
}

TEST_F(CarrierTest, ReportsSilenceWithLatencyOfThePath) {
  carrier.start(read, 5us);
  carrier.sent(10us);
  carrier.tick(carrier.due() - 1ns);
  EXPECT_TRUE(carrier.is_busy());
  carrier.tick(carrier.due());
  EXPECT_FALSE(carrier.is_busy());
  EXPECT_EQ(read.error(), Error::timeout);
  EXPECT_EQ(carrier.silences(), 1u);
}

TEST_F(CarrierTest, GapLimitAppliesAfterFirstCharacterOfReply) {
  carrier.start(read, 5us);
  carrier.sent(10us);
  carrier.received(std::span(reply).first(3), 30us);
  EXPECT_EQ(carrier.due(), 30us + tformat::gap_limit + 1ms);
  carrier.tick(carrier.due());
  EXPECT_EQ(read.error(), Error::wrong_length);
}

TEST_F(CarrierTest, DropsItemsWithoutConversation) {
  carrier.received(reply, 1us);
  carrier.sent(2us);
  carrier.tick(3us);
  EXPECT_EQ(line.results, 0u);
}

// A machine that requests its transfer for a time in the future.
struct Later final : Machine<std::uint8_t> {
  void feed(const ByteEvent& event) override { over = event.kind == ByteEvent::Kind::sent; }
  ByteStep next(Time) override {
    if (over) return {.kind = ByteStep::Kind::done};
    if (asked) return {.at = never};
    asked = true;
    return {.kind = ByteStep::Kind::transfer, .out = reply, .at = 50us};
  }
  bool asked = false, over = false;
};

TEST_F(CarrierTest, StartsTransferAtItsTime) {
  Later later;
  carrier.start(later, 5us);
  EXPECT_TRUE(line.sent.empty());
  EXPECT_EQ(carrier.due(), 50us);
  carrier.tick(49us);
  EXPECT_TRUE(line.sent.empty());
  carrier.tick(50us);
  EXPECT_EQ(line.sent.size(), reply.size());
  carrier.sent(60us);
  EXPECT_EQ(line.results, 1u);
}

}  // namespace
}  // namespace absenc::host
