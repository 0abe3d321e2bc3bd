// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/frame_bus.hpp"

#include <gtest/gtest.h>

#include "tests/shape_toys.hpp"

namespace absenc::sim {
namespace {

using namespace std::chrono_literals;
using Toy = toy::Toy<CanFrame>;
using Kind = Event<CanFrame>::Kind;
using StepKind = Step<CanFrame>::Kind;

CanFrame frame(std::uint32_t id, std::uint8_t data) { return {.id = id, .size = 1, .data = {data}}; }

std::string sent_by(FrameBus& bus, Time now) {
  std::string sent;
  for (auto step = bus.next(now); step.kind != StepKind::wait; step = bus.next(now)) {
    if (step.kind == StepKind::configure) {
      sent += "rate " + std::to_string(step.rate) + ' ';
      continue;
    }
    sent += toy::text_of(step.out[0]) + ' ';
    bus.feed({.kind = Kind::sent, .at = now});
  }
  return sent;
}

TEST(FrameBus, DeliversFramesOfHostAndOtherNodes) {
  Toy one([](Toy& self, const Event<CanFrame>& event) {
    if (event.kind == Kind::received && event.items[0].id == 0x200) self.send({frame(0x120, 1)});
  });
  Toy two;
  FrameBus bus({&one, &two}, 250'000);
  EXPECT_EQ(bus.next(0ms).at, never);
  const CanFrame request = frame(0x200, 9);
  bus.feed({.kind = Kind::received, .at = 1ms, .items = {&request, 1}});
  EXPECT_EQ(sent_by(bus, 1ms), "120:01 ");
  EXPECT_EQ(one.log, "1000000 received 200:09, 1000000 sent");
  EXPECT_EQ(two.log, "1000000 received 200:09, 1000000 received 120:01");
}

TEST(FrameBus, SendsLowestIdentifierFirstAtItsTime) {
  Toy high;
  high.send({frame(0x121, 1)}, 5ms);
  Toy low;
  low.send({frame(0x120, 2), frame(0x100, 3)}, 5ms);
  FrameBus bus({&high, &low}, 250'000);
  EXPECT_EQ(bus.next(0ms).at, 5ms);
  bus.feed({.kind = Kind::timer, .at = 5ms});
  EXPECT_EQ(sent_by(bus, 5ms), "120:02 100:03 121:01 ");
}

TEST(FrameBus, TimersOfEachNode) {
  Toy one;
  one.idle.at = 3ms;
  Toy two;
  two.idle.at = 7ms;
  FrameBus bus({&one, &two}, 250'000);
  EXPECT_EQ(bus.next(0ms).at, 3ms);
  bus.feed({.kind = Kind::timer, .at = 3ms});
  EXPECT_EQ(one.log, "3000000 timer");
  EXPECT_EQ(two.log, "");
  EXPECT_EQ(bus.next(3ms).at, 7ms);
}

TEST(FrameBus, IsolatesNodeAtAnotherBitRate) {
  Toy moved;
  moved.push({.kind = StepKind::configure, .rate = 500'000});
  moved.send({frame(0x120, 1)});
  Toy other;
  FrameBus bus({&moved, &other}, 250'000);
  EXPECT_EQ(sent_by(bus, 0ms), "");
  const CanFrame request = frame(0x200, 9);
  bus.feed({.kind = Kind::received, .at = 1ms, .items = {&request, 1}});
  EXPECT_EQ(moved.log, "");
  EXPECT_EQ(other.log, "1000000 received 200:09");
  other.push({.kind = StepKind::configure, .rate = 500'000});
  EXPECT_EQ(sent_by(bus, 2ms), "rate 500000 120:01 ");
}

}  // namespace
}  // namespace absenc::sim
