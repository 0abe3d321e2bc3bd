// SPDX-License-Identifier: Apache-2.0
// Tests of the host commands for one node: position, cyclic positions, zero and direction.
#include "absenc/protocol/raa38/can/bench_test.hpp"

namespace absenc::raa38::can {
namespace {

using namespace testing;

/// Drives a conversation without a bus: a test feeds each event.
struct ByHand {
  explicit ByHand(std::string_view command) : talk(command) {}
  Step<CanFrame>::Kind next() { return talk->next(now).kind; }
  void tell(Event<CanFrame>::Kind kind, Time at) { talk->feed({.kind = kind, .at = at}); }
  void sent() { tell(Event<CanFrame>::Kind::sent, now); }
  void receive(const CanFrame& frame, Time after = {}) {
    talk->feed({.kind = Event<CanFrame>::Kind::received, .at = now + after, .items = {&frame, 1}});
  }
  Talk talk;
  Time now = 1s;
};
using Kind = Step<CanFrame>::Kind;

CanFrame extended_position() {
  CanFrame frame = encode_position(0x20, 7);
  frame.extended = true;
  return frame;
}

// ---- Position

TEST(Raa38CanRead, PollsAndListens) {
  Bench bench;
  bench.put(9799);
  EXPECT_EQ(bench.position(), 9799u);
  const CommandResult listening = bench.run_command("listen");
  EXPECT_EQ(listening.reading->singleturn, 9799u);
  EXPECT_EQ(listening.reading->latched, listening.reading->received);
  EXPECT_LE(listening.took, 101ms);
  EXPECT_TRUE(bench.run_command("start").has("singleturn=9799"));
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
}

TEST(Raa38CanRead, TimesOutWithoutNode) {
  Bench bench({.node = 0x21, .cyclic = 0});
  EXPECT_TRUE(ended(bench.run_command(Format{}, "position"), Error::timeout, "scan"));
  EXPECT_TRUE(ended(bench.run_command(Format{}, "listen"), Error::timeout, "by itself"));
  // The bus is busy: node 21 (hex), which the host does not ask, sends 255 positions per second, so there is never a
  // silence of 50 ms.
  Bench busy({.node = 0x21, .cyclic = 255});
  const CommandResult read = busy.run_command(Format{}, "position");
  EXPECT_TRUE(ended(read, Error::timeout));
  EXPECT_LE(read.took, 300ms);
}

TEST(Raa38CanRead, IgnoresFramesFromBeforeTheRequest) {
  for (const std::string_view command : {"position", "listen"}) {
    ByHand by_hand(command);
    by_hand.next();
    if (command == "position") {
      by_hand.receive(encode_position(0x20, 1));  // a position that is received before the request is sent
      by_hand.sent();
    }
    // This position arrives now, but was received 1 ms before the request was sent, or before the host began to listen.
    by_hand.receive(encode_position(0x20, 2), -1ms);
    EXPECT_EQ(by_hand.next(), Kind::wait);
    by_hand.receive(encode_position(0x20, 3), 1ms);
    EXPECT_EQ(by_hand.next(), Kind::done);
    EXPECT_EQ(by_hand.talk->reading()->singleturn, 3u);
  }
}

TEST(Raa38CanRead, IgnoresFramesOfOtherNodes) {
  for (const CanFrame& other :
       {encode_position(0x21, 5), extended_position(), encode(Order::read, 0x20), CanFrame{.id = 0x80}}) {
    ByHand by_hand("position");
    by_hand.next();
    by_hand.sent();
    by_hand.receive(other);
    EXPECT_EQ(by_hand.next(), Kind::wait);
    by_hand.tell(Event<CanFrame>::Kind::silence, by_hand.now + 50ms);
    // If only a frame with a 29-bit identifier came, the host reports this frame instead of a timeout.
    const bool is_long = other.extended;
    EXPECT_EQ(by_hand.talk->error(), is_long ? Error::unexpected_reply : Error::timeout);
    EXPECT_EQ(says(by_hand.talk->detail(), "29 bits"), is_long);
  }
}

TEST(Raa38CanRead, ReportsBadFramesOfTheNode) {
  CanFrame seven = encode_position(0x20, 5);
  seven.size = 7;
  CanFrame remote = encode_position(0x20, 0);
  remote.remote = true;
  const std::pair<CanFrame, Error> rows[] = {{seven, Error::wrong_length},
                                             {remote, Error::bad_framing},
                                             {encode_position(0x20, 1 << 14), Error::out_of_range}};
  for (const auto& [frame, error] : rows) {
    ByHand by_hand("position");
    by_hand.next();
    by_hand.sent();
    by_hand.receive(frame);
    EXPECT_EQ(by_hand.next(), Kind::done);
    EXPECT_TRUE(ended(raa38::testing::result_of<CanFrame>(*by_hand.talk), error));
    EXPECT_FALSE(by_hand.talk->detail().empty());
    EXPECT_EQ(by_hand.talk->exchange().received.size(), 1u);
  }
}

TEST(Raa38CanRead, ReportsDestroyedFrames) {
  Bench bench(quiet);
  bench.put(100);
  bench.add_twin();
  EXPECT_TRUE(ended(bench.run_command("position"), Error::bad_framing, "one number"));
}

// ---- Cyclic positions

TEST(Raa38CanCyclic, StartsAndStopsCyclicFrames) {
  Bench bench;
  for (const int rate : {0, 1, 2, 3, 100, 255, 7, 0}) {
    const CommandResult cyclic = rate == 0 ? bench.run_command("stop") : bench.run_command("cyclic", {rate});
    EXPECT_TRUE(ended(cyclic, Error::none)) << rate;
    EXPECT_EQ(cyclic.fields, "node=32 readings_per_s=" + std::to_string(rate) + " answered=1 ");
  }
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
}

// Each cyclic position of the node is 49 (31 hex), so that it equals the answer to order 31.
TEST(Raa38CanCyclic, FailsWhenSendRateDoesNotChange) {
  for (const std::int64_t rate : {0, 10}) {
    Scripted disobedient([](const CanFrame&) { return Frames{}; });
    disobedient.period = 20ms;
    EXPECT_TRUE(ended(rate == 0 ? with(disobedient, "stop") : with(disobedient, "cyclic", {rate}),
                      Error::cross_check_failed, rate == 0 ? "goes on" : "more or fewer"));
  }
}

TEST(Raa38CanCyclic, RepeatsMeasurementAfterLateFrames) {
  unsigned left = 3;
  Scripted node([&](const CanFrame&) { return Frames{}; });
  node.period = 400ms;
  node.left = &left;
  EXPECT_TRUE(ended(with(node, "stop"), Error::none));
  EXPECT_EQ(left, 0u);
}

// ---- Zero

TEST(Raa38CanZero, SetsZeroAndRestoresSendRate) {
  for (const std::uint8_t rate : std::to_array<std::uint8_t>({0, 1, 10, 200})) {
    Bench bench({.cyclic = rate});
    bench.put(9799);
    const CommandResult zero = bench.run_command("zero");
    EXPECT_TRUE(ended(zero, Error::none));
    EXPECT_EQ(zero.fields, "node=32 written=1 answered=1 before=9799 after=0 ");
    EXPECT_EQ(bench.position(), 0u);
    EXPECT_TRUE(bench.run_command("zero").has("written=0")) << "it is zero already";
    EXPECT_EQ(bench.encoder().settings().writes(), 1u);
    EXPECT_EQ(bench.encoder().violation_count(), 0u);
    EXPECT_NEAR(static_cast<double>(bench.count(2s)), 2.0 * rate, 1.0 + 0.005 * rate);
  }
}

TEST(Raa38CanZero, RefusesWhileShaftTurns) {
  Bench bench;
  bench.put(5000);
  bench.shaft.spin(600, bench.line.now());
  EXPECT_TRUE(ended(bench.run_command("zero"), Error::not_still, "nothing was changed"));
  EXPECT_EQ(bench.encoder().settings().writes(), 0u);
}

TEST(Raa38CanZero, FailsWhenPositionDoesNotBecomeZero) {
  // The node's answer to order 20 (hex) equals a frame with the position 32, which at 21 bits is near 0.
  for (const std::uint32_t counts : {32u << 10, 1'000'000u}) {
    Scripted stubborn([&](const CanFrame& request) { return correct_answer(request, counts); });
    const CommandResult zero = with(stubborn, "zero", {}, {.bits = 21});
    EXPECT_TRUE(ended(zero, Error::cross_check_failed, "answered, but"));
    EXPECT_TRUE(says(zero.words, "command 20"));
  }
  const Scripted silent([](const CanFrame& request) {
    return request.data[0] == info_of(Order::read).code ? correct_answer(request, 5000) : Frames{};
  });
  EXPECT_TRUE(ended(with(silent, "zero"), Error::cross_check_failed, "did not answer"));
  EXPECT_TRUE(ended(with(silent, "direction", {1}), Error::timeout, "is the same"));
}

// A late answer to order 20 (hex) equals a frame with the position 32, which at 21 bits is near 0.
TEST(Raa38CanZero, RejectsLateAnswerAsZeroPosition) {
  bool answer_pending = false;
  Scripted late([&](const CanFrame& request) {
    const bool zero = order_of(request)->order == Order::zero;
    if (std::exchange(answer_pending, zero)) return Frames{encode_answer(0x20, Order::zero)};
    return zero ? Frames{} : correct_answer(request, 1'000'000);
  });
  EXPECT_TRUE(ended(with(late, "zero", {}, {.bits = 21}), Error::cross_check_failed));
}

// The cyclic frames arrive up to 4 ms early or late, as through a slow adapter.
TEST(Raa38CanZero, RestoresSendRateThroughSlowCarrier) {
  unsigned left = 1000;
  unsigned rate = 0;
  Scripted node([&](const CanFrame& request) {
    const bool cyclic = order_of(request)->order == Order::cyclic;
    if (cyclic) rate = request.data[info_of(Order::cyclic).value_at];
    if (cyclic) left = rate == 0 ? 0 : 1000;
    return correct_answer(request, 0);
  });
  node.period = 10ms;
  node.wobble = 4ms;
  node.left = &left;
  EXPECT_TRUE(ended(with(node, "zero"), Error::none));
  EXPECT_NEAR(rate, 100, 1);
}

TEST(Raa38CanZero, ReportsNodeThatDoesNotResumeSending) {
  unsigned left = 1000;
  Scripted exhausted([&](const CanFrame& request) {
    if (order_of(request)->order == Order::read) return correct_answer(request, 0);
    left = 0;
    return Frames{};
  });
  exhausted.unsolicited = encode_position(0x20, 0);
  exhausted.period = 100ms;
  exhausted.left = &left;
  EXPECT_TRUE(ended(with(exhausted, "zero"), Error::cross_check_failed, "no longer sends"));
}

// A cyclic position of 32 equals the answer to order 20 (hex).
TEST(Raa38CanZero, RejectsCyclicPositionThatLooksLikeAnswer) {
  for (const Time period : {80ms, 100ms}) {
    unsigned left = 1000;
    std::uint64_t counts = 32;
    Scripted slow([&](const CanFrame& request) {
      const Order order = order_of(request)->order;
      if (order == Order::cyclic) left = request == encode(order, 0x20, 0) ? 1 : 1000;
      if (order == Order::zero) counts = 0;
      return order == Order::zero ? Frames{} : correct_answer(request, counts);
    });
    slow.unsolicited = encode_position(0x20, 32);
    slow.period = period;
    slow.left = &left;
    EXPECT_TRUE(with(slow, "zero").has("answered=0"));
  }
}

// ---- Direction

TEST(Raa38CanDirection, ReportsMirroredPosition) {
  Bench bench;
  bench.put(1000);
  const CommandResult negative = bench.run_command("direction", {1});
  EXPECT_TRUE(ended(negative, Error::none));
  EXPECT_EQ(negative.fields, "node=32 value=1 answered=1 mirrored=1 before=1000 after=15384 ");
  EXPECT_EQ(bench.position(), (1u << 14) - 1000);
  EXPECT_TRUE(ended(bench.run_command("direction", {0}), Error::none));
  EXPECT_EQ(bench.position(), 1000u);
  EXPECT_EQ(bench.encoder().settings().writes(), 2u);
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
  EXPECT_TRUE(bench.run_command("direction", {0}).has("mirrored=0"));
  EXPECT_EQ(bench.encoder().violation_count(), 1u) << "nobody can know before that it wears the memory";
}

TEST(Raa38CanDirection, FailsWhenPositionIsNeitherSameNorMirrored) {
  std::uint32_t counts = 1000;
  Scripted jumping([&](const CanFrame& request) {
    if (order_of(request)->order == Order::direction) counts = 7000;
    return correct_answer(request, counts);
  });
  EXPECT_TRUE(ended(with(jumping, "direction", {1}), Error::cross_check_failed, "mirror image"));
}

// A position that the node sends only once may be a late answer to an order.
TEST(Raa38CanDirection, RejectsPositionThatIsNotRepeated) {
  unsigned measurements = 0;
  Scripted late([&](const CanFrame& request) {
    const bool third = order_of(request)->order == Order::read && ++measurements == 3;
    return correct_answer(request, third ? 32u : 1000u);
  });
  EXPECT_TRUE(ended(with(late, "direction", {0}), Error::cross_check_failed, "mirror image"));
}

TEST(Raa38CanDirection, UsesValuesOfOptions) {
  Bench bench({.positive = 0x10, .negative = 0x11});
  bench.put(1000);
  EXPECT_TRUE(bench.run_command("direction", {1}).has("value=17"));
  EXPECT_TRUE(bench.encoder().settings().counts_down());
}

}  // namespace
}  // namespace absenc::raa38::can
