// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/carrier.hpp"

#include <gtest/gtest.h>

#include <array>
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
  EXPECT_EQ(carrier.due(), never);  // until it is sent
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

TEST_F(CarrierTest, TellsSilenceWithTheLatencyOfTheWay) {
  carrier.start(read, 5us);
  carrier.sent(10us);
  carrier.tick(carrier.due() - 1ns);
  EXPECT_TRUE(carrier.is_busy());
  carrier.tick(carrier.due());
  EXPECT_FALSE(carrier.is_busy());
  EXPECT_EQ(read.error(), Error::timeout);
  EXPECT_EQ(carrier.silences(), 1u);
}

TEST_F(CarrierTest, AfterABeginOfAReplyTheGapCounts) {
  carrier.start(read, 5us);
  carrier.sent(10us);
  carrier.received(std::span(reply).first(3), 30us);
  EXPECT_EQ(carrier.due(), 30us + tformat::gap_limit + 1ms);
  carrier.tick(carrier.due());
  EXPECT_EQ(read.error(), Error::wrong_length);
}

TEST_F(CarrierTest, WhatComesUnaskedIsNobodys) {
  carrier.received(reply, 1us);
  carrier.sent(2us);
  carrier.tick(3us);
  EXPECT_EQ(line.results, 0u);
}

// A machine that sends later.
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

TEST_F(CarrierTest, HoldsATransferUntilItsTime) {
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
