// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include "absenc/protocol/raa38/can/bench_test.hpp"

namespace absenc::raa38::can {
namespace {

using testing::Bench;
using testing::report;
using testing::silent;
using testing::Talk;

/// Drives a conversation without a bus: the test says what happens.
struct ByHand {
  explicit ByHand(Conversation<CanFrame>& conversation) : machine(conversation) {}
  Step<CanFrame> next() { return machine.next(now); }
  void sent() { machine.feed({.kind = Event<CanFrame>::Kind::sent, .at = now}); }
  void receive(const CanFrame& frame, Time at) {
    machine.feed({.kind = Event<CanFrame>::Kind::received, .at = at, .items = {&frame, 1}});
  }
  void receive(const CanFrame& frame) { receive(frame, now); }
  Conversation<CanFrame>& machine;
  Time now = 1s;
};

TEST(CanRead, AsksAndListens) {
  Bench bench;
  bench.shaft.put(0, 9799);
  EXPECT_EQ(bench.read(), 9799u);
  Talk listening({}, "listen");
  const Time before = bench.line.now();
  bench.run(listening);
  ASSERT_NE(listening.reading(), nullptr);
  EXPECT_EQ(listening.reading()->singleturn, 9799u);
  EXPECT_LE(bench.line.now() - before, 101ms);
  Talk start({}, "start");
  EXPECT_EQ(report(bench.run(start))["singleturn"], 9799);
  EXPECT_EQ(bench.node().violation_count(), 0u);
}

TEST(CanRead, NobodyThere) {
  Bench bench({.node = 0x21, .cyclic = 0});
  Talk read({}, "position");
  EXPECT_EQ(bench.run(read).error(), Error::timeout);
  EXPECT_NE(read.advice().find("scan"), std::string_view::npos);
  Talk listening({}, "listen");
  EXPECT_EQ(bench.run(listening).error(), Error::timeout);
  EXPECT_NE(listening.detail().find("by itself"), std::string_view::npos);
}

// Frames of others never end, so the line is never silent.
TEST(CanRead, NobodyThereOnABusyBus) {
  Bench bench({.node = 0x21, .cyclic = 255});
  Talk read({}, "position");
  EXPECT_EQ(bench.run(read).error(), Error::timeout);
  EXPECT_LE(bench.line.now(), 300ms);
}

TEST(CanRead, WhatWasUnderWayBeforeIsNoAnswer) {
  Talk read({}, "position");
  ByHand by_hand(read);
  EXPECT_EQ(by_hand.next().kind, Step<CanFrame>::Kind::transfer);
  by_hand.receive(encode_position(0x20, 1));  // before the request is out
  by_hand.sent();
  by_hand.receive(encode_position(0x20, 2), by_hand.now - 1ms);  // from a queue, told late
  EXPECT_EQ(by_hand.next().kind, Step<CanFrame>::Kind::wait);
  by_hand.receive(encode_position(0x20, 3), by_hand.now + 1ms);
  EXPECT_EQ(by_hand.next().kind, Step<CanFrame>::Kind::done);
  EXPECT_EQ(read.reading()->singleturn, 3u);
}

TEST(CanRead, WhatListeningHeardBeforeItBeganIsOld) {
  Talk read({}, "listen");
  ByHand by_hand(read);
  EXPECT_EQ(by_hand.next().kind, Step<CanFrame>::Kind::wait);
  by_hand.receive(encode_position(0x20, 2), by_hand.now - 1ms);
  EXPECT_EQ(by_hand.next().kind, Step<CanFrame>::Kind::wait);
  by_hand.receive(encode_position(0x20, 3), by_hand.now + 1ms);
  EXPECT_EQ(by_hand.next().kind, Step<CanFrame>::Kind::done);
  EXPECT_EQ(read.reading()->singleturn, 3u);
}

TEST(CanRead, ALongIdentifierIsToldWhereNothingElseComes) {
  CanFrame extended = encode_position(0x20, 7);
  extended.extended = true;
  Talk read({}, "position");
  ByHand by_hand(read);
  by_hand.next();
  by_hand.sent();
  by_hand.receive(extended);
  read.feed({.kind = Event<CanFrame>::Kind::silence, .at = by_hand.now + 50ms});
  EXPECT_EQ(read.error(), Error::unexpected_reply);
  EXPECT_NE(read.detail().find("29 bits"), std::string_view::npos) << read.detail();
}

TEST(CanRead, FramesOfOthersAreLeftAside) {
  CanFrame extended = encode_position(0x20, 7);
  extended.extended = true;
  CanFrame asked = encode_command(0x20, command::read);
  for (const CanFrame& other : {encode_position(0x21, 5), extended, asked, CanFrame{.id = 0x80}}) {
    Talk read({}, "position");
    ByHand by_hand(read);
    by_hand.next();
    by_hand.sent();
    by_hand.receive(other);
    EXPECT_EQ(by_hand.next().kind, Step<CanFrame>::Kind::wait);
  }
}

TEST(CanRead, BadFramesOfTheNodeAreErrors) {
  CanFrame seven = encode_position(0x20, 5);
  seven.size = 7;
  CanFrame remote = encode_position(0x20, 0);
  remote.remote = true;
  const std::pair<CanFrame, Error> cases[] = {{seven, Error::wrong_length},
                                              {remote, Error::bad_framing},
                                              {encode_position(0x20, 1 << 14), Error::out_of_range}};
  for (const auto& [frame, error] : cases) {
    Talk read({}, "position");
    ByHand by_hand(read);
    by_hand.next();
    by_hand.sent();
    by_hand.receive(frame);
    EXPECT_EQ(by_hand.next().kind, Step<CanFrame>::Kind::done);
    EXPECT_EQ(read.error(), error);
    EXPECT_EQ(read.reading(), nullptr);
    EXPECT_FALSE(read.detail().empty());
    EXPECT_EQ(read.exchange().received.size(), 1u);
  }
}

TEST(CanRead, DestroyedFramesAreNamed) {
  Bench bench({.cyclic = 0});
  bench.shaft.put(0, 100);
  bench.add({.positive = 1, .negative = 0, .cyclic = 0});
  // Both answer at once, with other data: the second counts the other way.
  bench.raw(encode_command(0x20, command::direction, 0));
  ASSERT_NE(bench.nodes[0]->position(bench.line.now()), bench.nodes[1]->position(bench.line.now()));
  Talk read({}, "position");
  EXPECT_EQ(bench.run(read).error(), Error::bad_framing);
  EXPECT_NE(read.advice().find("one number"), std::string_view::npos);
}

TEST(CanCyclic, StartsAndStops) {
  Bench bench;
  for (const std::uint8_t rate : std::to_array<std::uint8_t>({0, 1, 2, 3, 100, 255, 7, 0})) {
    Talk cyclic({}, "cyclic", {rate});
    EXPECT_EQ(bench.run(cyclic).error(), Error::none) << int{rate} << cyclic.detail();
    EXPECT_EQ(report(cyclic)["readings_per_s"], rate);
    EXPECT_EQ(report(cyclic)["answered"], 1);
  }
  EXPECT_EQ(bench.node().violation_count(), 0u);
}

// A position of 49 is no answer: what counts is what the node does.
TEST(CanCyclic, ANodeThatDoesNotObey) {
  struct Deaf final : Machine<CanFrame> {
    void feed(const Event<CanFrame>& event) override {
      if (event.kind == Event<CanFrame>::Kind::sent) at = event.at + 20ms, sending = false;
    }
    Step<CanFrame> next(Time) override {
      if (std::exchange(sending, true)) return {.at = never};
      return {.kind = Step<CanFrame>::Kind::transfer, .out = {&frame, 1}, .at = at};
    }
    CanFrame frame = encode_position(0x20, 49);
    Time at = 5ms;
    bool sending = false;
  } deaf;
  sim::Line<CanFrame> line(LinkKind::can, {.rate = 250'000});
  line.attach(sim::Role::device, deaf);
  Talk stop({}, "stop");
  EXPECT_TRUE(line.run(line.attach(sim::Role::host, stop), 10s));
  EXPECT_EQ(stop.error(), Error::cross_check_failed);
  EXPECT_NE(stop.detail().find("goes on"), std::string_view::npos);
  Talk other({}, "cyclic", {10});
  EXPECT_TRUE(line.run(line.attach(sim::Role::host, other), 20s));
  EXPECT_EQ(other.error(), Error::cross_check_failed);
}

TEST(CanZero, IsZeroAndSendsAgainAsBefore) {
  for (const std::uint8_t rate : std::to_array<std::uint8_t>({0, 1, 10, 200})) {
    Bench bench({.cyclic = rate});
    bench.shaft.put(0, 9799);
    Talk zero({}, "zero");
    EXPECT_EQ(bench.run(zero).error(), Error::none) << zero.detail();
    EXPECT_EQ(report(zero)["before"], 9799);
    EXPECT_EQ(report(zero)["after"], 0);
    EXPECT_EQ(report(zero)["written"], 1);
    EXPECT_EQ(bench.read(), 0u);
    EXPECT_EQ(bench.node().wear(), 1u);
    EXPECT_EQ(bench.node().violation_count(), 0u);
    testing::RawHost listening(CanFrame{.id = 0x7FF}, bench.line.now() + 2s);
    const std::size_t heard = bench.run(listening).heard.size();
    EXPECT_NEAR(static_cast<double>(heard), 2.0 * rate, 1.0 + 0.005 * rate);
  }
}

TEST(CanZero, WritesNothingWhenItIsZero) {
  Bench bench;
  Talk zero({}, "zero");
  EXPECT_EQ(bench.run(zero).error(), Error::none);
  EXPECT_EQ(report(zero)["written"], 0);
  EXPECT_EQ(bench.node().wear(), 0u);
}

TEST(CanZero, AShaftThatTurns) {
  Bench bench;
  bench.shaft.put(0, 5000);
  bench.shaft.spin(600, bench.line.now());
  Talk zero({}, "zero");
  EXPECT_EQ(bench.run(zero).error(), Error::invalid_argument);
  EXPECT_EQ(bench.node().wear(), 0u);
}

// A node that has another meaning for command 20, or none: its answer looks right, its position does not move.
struct Stubborn final : Machine<CanFrame> {
  explicit Stubborn(std::uint32_t where, bool answering = true) : counts(where), answers(answering) {}
  void feed(const Event<CanFrame>& event) override {
    if (event.kind != Event<CanFrame>::Kind::received) return;
    const std::uint8_t code = event.items[0].data[0];
    due = code == command::read || answers;
    frame = code == command::read ? encode_position(0x20, counts) : encode_answer(0x20, code);
  }
  Step<CanFrame> next(Time) override {
    if (!std::exchange(due, false)) return {.at = never};
    return {.kind = Step<CanFrame>::Kind::transfer, .out = {&frame, 1}};
  }
  std::uint32_t counts;
  bool answers;
  bool due = false;
  CanFrame frame{};
};

template <class Conversation>
Conversation& with(Stubborn& node, Conversation& conversation) {
  sim::Line<CanFrame> line(LinkKind::can, {.rate = 250'000});
  line.attach(sim::Role::device, node);
  EXPECT_TRUE(line.run(line.attach(sim::Role::host, conversation), 20s));
  return conversation;
}

TEST(CanZero, AnAnswerAloneIsNoZero) {
  // 32 is the answer read as a position: at 21 bits that would be near 0.
  for (const std::uint32_t counts : {32u << 10, 1'000'000u}) {
    Stubborn node(counts);
    Talk zero({.bits = 21}, "zero");
    EXPECT_EQ(with(node, zero).error(), Error::cross_check_failed);
    EXPECT_NE(zero.detail().find("answered, but"), std::string_view::npos);
    EXPECT_NE(zero.advice().find("command 20"), std::string_view::npos);
  }
  Stubborn silent_node(5000, false);
  Talk zero({}, "zero");
  EXPECT_EQ(with(silent_node, zero).error(), Error::cross_check_failed);
  EXPECT_NE(zero.detail().find("did not answer"), std::string_view::npos);
}

// The answer to 20 comes after its time, where a position is due: at 21 bits, 32 is near 0.
TEST(CanZero, ALateAnswerIsNoZero) {
  struct Late final : Machine<CanFrame> {
    void feed(const Event<CanFrame>& event) override {
      if (event.kind != Event<CanFrame>::Kind::received) return;
      const bool zero = event.items[0].data[0] == command::zero;
      due = !zero;
      frame = std::exchange(late, zero) ? encode_answer(0x20, command::zero) : encode_position(0x20, 1'000'000);
    }
    Step<CanFrame> next(Time) override {
      if (!std::exchange(due, false)) return {.at = never};
      return {.kind = Step<CanFrame>::Kind::transfer, .out = {&frame, 1}};
    }
    bool due = false;
    bool late = false;
    CanFrame frame{};
  } node;
  Talk zero({.bits = 21}, "zero");
  sim::Line<CanFrame> line(LinkKind::can, {.rate = 250'000});
  line.attach(sim::Role::device, node);
  EXPECT_TRUE(line.run(line.attach(sim::Role::host, zero), 20s));
  EXPECT_EQ(zero.error(), Error::cross_check_failed);
}

// Sends by itself until it is told not to, and never again.
struct Exhausted final : Machine<CanFrame> {
  void feed(const Event<CanFrame>& event) override {
    if (event.kind == Event<CanFrame>::Kind::sent) sending = false;
    if (event.kind != Event<CanFrame>::Kind::received) return;
    cyclic = cyclic && event.items[0].data[0] != command::cyclic;
    asked = event.items[0].data[0] == command::read;
  }
  Step<CanFrame> next(Time now) override {
    if (sending) return {.at = never};
    if (!asked && !cyclic) return {.at = never};
    if (!asked && now < due) return {.at = due};
    due = now + 100ms;
    asked = false;
    sending = true;
    return {.kind = Step<CanFrame>::Kind::transfer, .out = {&frame, 1}};
  }
  CanFrame frame = encode_position(0x20, 0);
  Time due{};
  bool cyclic = true;
  bool asked = false;
  bool sending = false;
};

TEST(CanZero, ANodeThatNoLongerSendsIsTold) {
  Exhausted node;
  sim::Line<CanFrame> line(LinkKind::can, {.rate = 250'000});
  line.attach(sim::Role::device, node);
  Talk zero({}, "zero");
  EXPECT_TRUE(line.run(line.attach(sim::Role::host, zero), 20s));
  EXPECT_EQ(zero.error(), Error::cross_check_failed);
  EXPECT_NE(zero.detail().find("no longer sends"), std::string_view::npos) << zero.detail();
}

// A node that jumps instead of mirroring its position.
TEST(CanDirection, AnotherPositionIsNoDirection) {
  struct Jumping final : Machine<CanFrame> {
    void feed(const Event<CanFrame>& event) override {
      if (event.kind != Event<CanFrame>::Kind::received) return;
      due = true;
      const bool read = event.items[0].data[0] == command::read;
      if (!read) counts = 7000;
      frame = read ? encode_position(0x20, counts) : encode_answer(0x20, event.items[0].data[0]);
    }
    Step<CanFrame> next(Time) override {
      if (!std::exchange(due, false)) return {.at = never};
      return {.kind = Step<CanFrame>::Kind::transfer, .out = {&frame, 1}};
    }
    std::uint32_t counts = 1000;
    bool due = false;
    CanFrame frame{};
  } node;
  sim::Line<CanFrame> line(LinkKind::can, {.rate = 250'000});
  line.attach(sim::Role::device, node);
  Talk direction({}, "direction", {1});
  EXPECT_TRUE(line.run(line.attach(sim::Role::host, direction), 20s));
  EXPECT_EQ(direction.error(), Error::cross_check_failed);
}

TEST(CanDirection, IsMirrored) {
  Bench bench;
  bench.shaft.put(0, 1000);
  Talk negative({}, "direction", {1});
  EXPECT_EQ(bench.run(negative).error(), Error::none) << negative.detail();
  EXPECT_EQ(report(negative)["mirrored"], 1);
  EXPECT_EQ(bench.read(), (1u << 14) - 1000);
  Talk positive({}, "direction", {0});
  EXPECT_EQ(bench.run(positive).error(), Error::none);
  EXPECT_EQ(bench.read(), 1000u);
  EXPECT_EQ(bench.node().wear(), 2u);
  EXPECT_EQ(bench.node().violation_count(), 0u);
}

TEST(CanDirection, TheSameOnceMoreWearsTheMemory) {
  Bench bench;
  bench.shaft.put(0, 1000);
  Talk positive({}, "direction", {0});
  EXPECT_EQ(bench.run(positive).error(), Error::none);
  EXPECT_EQ(report(positive)["mirrored"], 0);
  EXPECT_EQ(bench.node().violation_count(), 1u);  // nobody can know before
}

TEST(CanDirection, NeitherAnswerNorEffect) {
  Stubborn node(1000, false);
  Talk direction({}, "direction", {1});
  EXPECT_EQ(with(node, direction).error(), Error::timeout);
}

TEST(CanDirection, OtherValues) {
  const Format format{.positive = 0x10, .negative = 0x11};
  Bench bench(format);
  bench.shaft.put(0, 1000);
  Talk negative(format, "direction", {1});
  EXPECT_EQ(bench.run(negative).error(), Error::none);
  EXPECT_EQ(report(negative)["value"], 0x11);
  EXPECT_TRUE(bench.node().is_negative());
}

}  // namespace
}  // namespace absenc::raa38::can
