// SPDX-License-Identifier: Apache-2.0
// Tests of sim::Line for behaviour that tests/shape_test.cpp does not cover.
#include "absenc/sim/line.hpp"
#include "absenc/sim/can_bits.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace absenc::sim {
namespace {

using std::chrono::microseconds;
using Byte = std::uint8_t;

// A machine that returns the step in `todo` once, and then waits.
class Puppet final : public Machine<Byte> {
 public:
  void feed(const Event<Byte>& event) override {
    static constexpr const char* names[] = {"sent", "received", "silence", "timer", "selected", "triggered", "error"};
    log += std::to_string(event.at.count()) + ' ' + names[static_cast<int>(event.kind)] + ' ';
  }
  Step<Byte> next(Time) override {
    const Step<Byte> step = todo.value_or(idle);
    todo.reset();
    return step;
  }
  std::optional<Step<Byte>> todo;
  Step<Byte> idle{};
  std::string log;
};

const std::vector<Byte> two{1, 2};
const Step<Byte> send_two{.kind = Step<Byte>::Kind::transfer, .out = two};

struct LineTest : testing::Test {
  Line<Byte> line{LinkKind::half_duplex, {.rate = 1'000'000}};
  Puppet device;
  Puppet host;
  Line<Byte>::Node device_node = line.attach(NodeRole::device, device);
  Line<Byte>::Node host_node = line.attach(NodeRole::host, host);
};

TEST_F(LineTest, WakeTakesAStepWithoutAnEvent) {
  EXPECT_EQ(line.next_event(), never);
  EXPECT_FALSE(line.step());
  line.run_until(microseconds(7));
  EXPECT_EQ(line.now(), microseconds(7));
  host.todo = send_two;
  line.wake(host_node);
  EXPECT_EQ(line.next_event(), microseconds(7));
  line.run_until(microseconds(100));
  EXPECT_EQ(device.log, "17000 received 27000 received ");
}

// The pause between two frames of a request is silence for the receiver.
TEST_F(LineTest, SendsFramesWithPausesBetweenThem) {
  const std::vector<Byte> five{1, 2, 3, 4, 5};
  device.idle.gap = microseconds(7);
  line.wake(device_node);
  host.todo = Step<Byte>{.kind = Step<Byte>::Kind::transfer, .frame = 2, .out = five, .width = microseconds(8)};
  line.wake(host_node);
  line.run_until(microseconds(100));
  EXPECT_EQ(device.log,
            "10000 received 20000 received 27000 silence 38000 received 48000 received 55000 silence 66000 received "
            "73000 silence ");
  EXPECT_EQ(host.log, "66000 sent ");
}

TEST_F(LineTest, ReplaceCutsOffTransferInProgress) {
  host.todo = send_two;
  line.wake(host_node);
  line.run_until(microseconds(15));
  Puppet successor;
  successor.idle.answer = microseconds(20);
  line.replace(host_node, successor);
  EXPECT_FALSE(line.run(host_node, microseconds(100)));
  EXPECT_EQ(device.log, "10000 received ");
  EXPECT_EQ(host.log, "");
  EXPECT_EQ(successor.log, "35000 silence ");
}

TEST_F(LineTest, ReplaceAfterDone) {
  host.todo = Step<Byte>{.kind = Step<Byte>::Kind::done};
  line.wake(host_node);
  EXPECT_TRUE(line.done(host_node));
  host.todo = send_two;
  line.wake(host_node);  // the line asks a machine that has returned `done` for no further steps
  EXPECT_EQ(line.next_event(), never);
  line.replace(host_node, host);
  EXPECT_FALSE(line.done(host_node));
  EXPECT_EQ(line.next_event(), Time{});
}

TEST_F(LineTest, IgnoresTimerInThePastAndReportsSilence) {
  host.idle = {.at = microseconds(10), .answer = microseconds(30)};
  host.todo = send_two;
  line.wake(host_node);
  line.run_until(microseconds(200));
  EXPECT_EQ(host.log, "10000 timer 20000 sent 50000 silence ");
}

TEST_F(LineTest, ObserverSeesWhatIsOnTheWire) {
  std::string seen;
  line.observe([&](Line<Byte>::Node sender, Time start, Time end, const Byte& item) {
    seen += std::to_string(sender) + ' ' + std::to_string(start.count()) + '-' + std::to_string(end.count()) + ' ' +
            std::to_string(item) + ' ';
  });
  host.todo = send_two;
  line.wake(host_node);
  line.run_until(microseconds(100));
  EXPECT_EQ(seen, "1 0-10000 1 1 10000-20000 2 ");
}

TEST(FullDuplex, HasOneWirePerDirection) {
  Line<Byte> line(LinkKind::full_duplex, {.rate = 1'000'000});
  const std::vector<Byte> other{6, 7};
  Puppet one;
  Puppet another;
  Puppet host;
  one.todo = another.todo = send_two;
  another.todo->out = other;
  another.todo->at = microseconds(5);
  host.todo = Step<Byte>{.kind = Step<Byte>::Kind::transfer, .out = std::span(other).first(1)};
  std::string items;
  line.observe([&](Line<Byte>::Node sender, Time, Time, const Byte& item) {
    items += std::to_string(sender) + ':' + std::to_string(item) + ' ';
  });
  line.attach(NodeRole::device, one);
  line.attach(NodeRole::device, another);
  line.attach(NodeRole::host, host);
  line.run_until(microseconds(100));
  EXPECT_EQ(items, "0:0 2:6 1:0 0:2 1:2 ");  // the bytes of the two devices are ANDed, the byte of the host is intact
  EXPECT_EQ(host.log, "10000 received 10000 sent 20000 received ");
  // The first device received the host's byte, and nothing from the other device.
  EXPECT_EQ(one.log, "10000 received 20000 sent ");
}

// A machine that sends one frame, either when its timer expires or by a step that names the time.
class CanPuppet final : public Machine<CanFrame> {
 public:
  CanPuppet(std::uint32_t id, Time at, bool by_timer) : frame_{.id = id}, at_(at), by_timer_(by_timer) {}
  void feed(const Event<CanFrame>& event) override {
    if (event.kind == Event<CanFrame>::Kind::timer) by_timer_ = false;
    for (const CanFrame& frame : event.items)
      log += std::to_string(event.at.count()) + ' ' + std::to_string(frame.id) + ' ';
    if (event.kind == Event<CanFrame>::Kind::line_error) log += "error ";
  }
  Step<CanFrame> next(Time) override {
    if (by_timer_) return {.at = at_};
    if (sent_) return {};
    sent_ = true;
    return {.kind = Step<CanFrame>::Kind::transfer, .out = {&frame_, 1}, .at = at_};
  }
  std::string log;

 private:
  CanFrame frame_;
  Time at_;
  bool by_timer_;
  bool sent_ = false;
};

struct CanLine : testing::Test {
  Line<CanFrame> line{LinkKind::can, {.rate = 1'000'000}};
  CanPuppet host{0, microseconds(1'000'000), false};
  // Returns the expected log entry of a frame that begins `after` microseconds after the start of the test.
  static std::string seen(std::uint32_t id, std::size_t after) {
    return std::to_string((after + length(id)) * 1000) + ' ' + std::to_string(id) + ' ';
  }
  static std::size_t length(std::uint32_t id) { return can_bits({.id = id}).size() + can_intermission_bits; }
  std::string run(CanPuppet first, CanPuppet second) {
    line.attach(NodeRole::device, first);
    line.attach(NodeRole::device, second);
    line.attach(NodeRole::host, host);
    line.run_until(microseconds(1000));
    return host.log;
  }
};

TEST_F(CanLine, ArbitratesAllFramesThatBeginTogether) {
  EXPECT_EQ(run({5, microseconds(10), false}, {4, microseconds(10), true}), seen(4, 10) + seen(5, 10 + length(4)));
}

TEST_F(CanLine, SameIdentifierLaterIsNoClash) {
  EXPECT_EQ(run({5, microseconds(10), false}, {5, microseconds(20), false}), seen(5, 10) + seen(5, 10 + length(5)));
}

TEST_F(CanLine, IdenticalFramesAreOne) {
  EXPECT_EQ(run({5, microseconds(10), false}, {5, microseconds(10), false}), seen(5, 10));
}

TEST(CanBits, ABitOfTheOtherKindFollowsFiveEqualOnes) {
  const std::vector<bool> bits = can_bits({.id = 0x7F0});
  const std::vector<bool> begin{false, true,  true,  true,  true,  true,  false, true,
                                true,  false, false, false, false, false, true};
  EXPECT_EQ(std::vector<bool>(bits.begin(), bits.begin() + 15), begin);
  EXPECT_EQ(std::vector<bool>(bits.end() - 10, bits.end()),
            (std::vector<bool>{true, false, true, true, true, true, true, true, true, true}));
}

TEST(LineSettingsOfALine, RateIsNeeded) { EXPECT_THROW(Line<Byte>(LinkKind::can, {}), std::invalid_argument); }

}  // namespace
}  // namespace absenc::sim
