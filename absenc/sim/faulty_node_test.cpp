// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/faulty_node.hpp"

#include <gtest/gtest.h>

#include "tests/shape_toys.hpp"

namespace absenc::sim {
namespace {

using namespace std::chrono_literals;
using Toy = toy::Toy<CanFrame>;
using Kind = Event<CanFrame>::Kind;
using StepKind = Step<CanFrame>::Kind;

const CanFrame request{.id = 0x220, .size = 8, .data = {0x80, 0x20}};
const CanFrame answer{.id = 0x120, .size = 8, .data = {0x47, 0x26}};

/// Outcome of one request to a device that answers every request.
struct FaultOutcome {
  std::vector<CanFrame> frames;
  Time at{};
  std::string received_frames;
  std::uint64_t count = 0;
  std::uint64_t damaged = 0;
};

FaultOutcome exchange(FaultKind kind, double rate = 1) {
  Toy device([](Toy& self, const Event<CanFrame>& event) {
    if (event.kind == Kind::received) self.send({answer}, event.at);
  });
  FaultRates rates;
  rates[kind] = rate;
  FaultyNode faulty(device, rates, 5);
  faulty.feed({.kind = Kind::received, .at = 1ms, .items = {&request, 1}});
  const Step<CanFrame> step = faulty.next(1ms);
  FaultOutcome result{{step.out.begin(), step.out.end()}, step.at, device.log};
  result.count = faulty.counts()[static_cast<std::size_t>(kind)];
  result.damaged = faulty.damaged_frames();
  return result;
}

TEST(FaultyNode, WithoutFaultsNothingChanges) {
  const FaultOutcome result = exchange(FaultKind::drop, 0);
  EXPECT_EQ(result.frames, std::vector<CanFrame>{answer});
  EXPECT_EQ(result.damaged, 0u);
}

TEST(FaultyNode, EachFault) {
  EXPECT_EQ(exchange(FaultKind::drop).frames[0].size, 7);
  EXPECT_LT(exchange(FaultKind::truncate).frames[0].size, 8);
  EXPECT_NE(exchange(FaultKind::corrupt).frames[0], answer);
  EXPECT_EQ(exchange(FaultKind::corrupt).frames[0].id, answer.id);
  EXPECT_EQ(exchange(FaultKind::delay).at, 1ms + FaultRates{}.delay);
  EXPECT_EQ(exchange(FaultKind::echo).frames, (std::vector<CanFrame>{request, answer}));
  EXPECT_EQ(exchange(FaultKind::repeat).frames, (std::vector<CanFrame>{answer, answer}));
  const FaultOutcome garbage = exchange(FaultKind::garbage);
  ASSERT_EQ(garbage.frames.size(), 2u);
  EXPECT_NE(garbage.frames[0], answer);
  EXPECT_EQ(garbage.frames[1], answer);
  for (const FaultKind kind : {FaultKind::drop, FaultKind::garbage, FaultKind::delay, FaultKind::repeat}) {
    EXPECT_EQ(exchange(kind).count, 1u);
    EXPECT_EQ(exchange(kind).damaged, 1u);
  }
}

TEST(FaultyNode, ReportsSuppressedFrameAsSent) {
  const FaultOutcome result = exchange(FaultKind::silence);
  EXPECT_TRUE(result.frames.empty());
  EXPECT_EQ(result.count, 1u);
}

TEST(FaultyNode, DamagesReceivedFrames) {
  const FaultOutcome result = exchange(FaultKind::request_corrupt);
  EXPECT_EQ(result.received_frames.find("220:8020000000000000"), std::string::npos);
  EXPECT_EQ(result.frames, std::vector<CanFrame>{answer});
}

}  // namespace
}  // namespace absenc::sim
