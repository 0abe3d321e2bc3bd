// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/reply_guard.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string_view>
#include <vector>

#include "absenc/host/session_bench_test.hpp"

namespace absenc::host {
namespace {

TEST(ReplyGuard, DelaysOnlyRequests) {
  struct OneStep final : Machine<std::uint8_t> {
    void feed(const Event<std::uint8_t>&) override {}
    Step<std::uint8_t> next(Time) override { return step; }
    Step<std::uint8_t> step;
  };
  using Kind = Step<std::uint8_t>::Kind;
  const Bench bench(EchoMode::off);
  const Wire bytes(17, 0x02);
  const auto first = [&](std::size_t size, Time at) {
    OneStep asks;
    asks.step = {.kind = Kind::transfer, .out = Bytes(bytes).first(size), .at = at};
    ReplyGuard<std::uint8_t> guard;
    guard.attach(asks, bench.unit, bench.options, true);
    return guard.next(1s);
  };
  EXPECT_EQ(first(0, {}).kind, Kind::transfer) << "clocks only";
  EXPECT_EQ(first(17, {}).kind, Kind::transfer) << "more than is kept of a request";
  EXPECT_EQ(first(1, {}).kind, Kind::wait);
  EXPECT_EQ(first(1, {}).at, 1s + 1ns);
  EXPECT_EQ(first(1, 1s + 1ms).at, 1s + 1ns) << "the port keeps a short pause more exactly";
  EXPECT_EQ(first(1, 1s + 5ms).at, 1s + 5ms);
}

/// A machine that sends one request and stores the items that it is fed.
struct OneRequest final : Machine<std::uint8_t> {
  using Kind = Step<std::uint8_t>::Kind;
  explicit OneRequest(Bytes asks = position) : request(asks) {}
  void feed(const Event<std::uint8_t>& event) override {
    sent = sent || event.kind == Event<std::uint8_t>::Kind::sent;
    heard.insert(heard.end(), event.items.begin(), event.items.end());
  }
  Step<std::uint8_t> next(Time now) override {
    if (sent) return {.expect = 6, .at = now + 1ms, .gap = gap};
    return {.kind = Kind::transfer, .out = request, .expect = 6, .gap = gap};
  }
  static constexpr Time gap = 200us;
  static constexpr std::array<std::uint8_t, 1> position{0x02};
  Bytes request;
  bool sent = false;
  Wire heard;
};

/// A guard to which requests are given one after another, by default those of T-format.
struct GuardedLine {
  using Kind = Step<std::uint8_t>::Kind;
  explicit GuardedLine(std::string_view id = "tformat", const std::vector<OptionText>& settings = {})
      : unit(*find_unit(id)) {
    EXPECT_EQ(resolve_options(unit, {}, settings, options).kind, OptionError::Kind::none);
  }
  /// Gives `asking` to the guard, and waits until its request is sent.
  void send(OneRequest& asking) {
    guard.attach(asking, unit, options, true);
    Step<std::uint8_t> step = guard.next(now);
    while (step.kind == Kind::wait) step = guard.next(now = step.at);
    EXPECT_EQ(step.kind, Kind::transfer);
    guard.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
  }
  /// Sends a request that is not answered, and waits for `pause`.
  void ask_in_vain(Time pause, Bytes request = OneRequest::position) {
    OneRequest unanswered(request);
    send(unanswered);
    guard.feed({.kind = Event<std::uint8_t>::Kind::silence, .at = now + 3ms});
    guard.conclude();
    now += pause;
  }
  /// Feeds a reply to the last request, received 100 us after it. Returns the guard's next step.
  Step<std::uint8_t> answer() {
    guard.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now + 100us, .items = reply});
    return guard.next(now + 100us);
  }
  const Wire reply{0x02, 0x00, 0x11, 0x22, 0x01, 0x02 ^ 0x11 ^ 0x22 ^ 0x01};
  const Unit& unit;
  Options options;
  ReplyGuard<std::uint8_t> guard;
  Time now = 1s;
};

TEST(ReplyGuard, RequestsAreOutstandingForTenSeconds) {
  const auto is_heard = [](Time pause) {
    GuardedLine line;
    line.ask_in_vain(pause);
    OneRequest again;
    line.send(again);
    line.answer();
    return again.heard == line.reply;
  };
  EXPECT_FALSE(is_heard(9s));
  EXPECT_TRUE(is_heard(11s));
}

// A line that stalled may deliver the replies to all requests of that time, with pauses in between.
TEST(ReplyGuard, ListensForHalfASecondAfterAStall) {
  GuardedLine line;
  for (int i = 0; i < 30; ++i) line.ask_in_vain(20ms);
  OneRequest again;
  line.send(again);
  const Step<std::uint8_t> step = line.answer();
  EXPECT_EQ(again.heard, Wire{});
  EXPECT_EQ(step.kind, GuardedLine::Kind::wait);
  EXPECT_EQ(step.at, line.now + 500ms);
}

TEST(ReplyGuard, SendsAfterATenthOfASecondOfNoise) {
  const Bench bench(EchoMode::off);
  ReplyGuard<std::uint8_t> guard;
  OneRequest asking;
  guard.attach(asking, bench.unit, bench.options, true);
  constexpr Time begin = 1s;
  Time now = begin;
  const Wire noise{0x55};
  while (guard.next(now).kind == Step<std::uint8_t>::Kind::wait && now < begin + 5s) {
    now += 100us;
    guard.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = noise});
  }
  EXPECT_GE(now, begin + 100ms);
  EXPECT_LT(now, begin + 110ms);
}

// At 2400 baud a reply may take longer than a tenth of a second.
TEST(ReplyGuard, LongReplyOnSlowLineIsNoNoise) {
  GuardedLine line("raa38-modbus", {{"baud", "2400"}});
  constexpr std::array<std::uint8_t, 4> other{0xFF, 0xA0, 0x40, 0x38};
  constexpr std::array<std::uint8_t, 8> request{0x01, 0x03, 0x00, 0x00, 0x00, 0x01, 0x84, 0x0A};
  const Wire reply{0x01, 0x03, 0x02, 0x01, 0x7F, 0xF8, 0x34};
  const auto receive = [&](Bytes items, Time after) {
    line.now += after;
    line.guard.feed({.kind = Event<std::uint8_t>::Kind::received, .at = line.now, .items = items});
    return line.guard.next(line.now).kind;
  };
  line.ask_in_vain(3ms, other);
  OneRequest answered(request);
  line.send(answered);
  // six bytes, 20 ms apart: 120 ms
  for (const std::uint8_t& byte : reply) EXPECT_EQ(receive({&byte, 1}, 20ms), GuardedLine::Kind::wait);
  EXPECT_EQ(answered.heard, reply);

  line.guard.conclude();
  OneRequest disturbed(request);
  line.guard.attach(disturbed, line.unit, line.options, true);
  const Time begin = line.now;
  const Wire noise{0x55};
  EXPECT_EQ(line.guard.next(line.now).kind, GuardedLine::Kind::wait);
  while (receive(noise, 100us) == GuardedLine::Kind::wait && line.now < begin + 5s) continue;
  const Time characters = 64 * line_settings(line.unit, line.options).character();
  EXPECT_GE(line.now, begin + characters);
  EXPECT_LT(line.now, begin + characters + 10ms);
}

}  // namespace
}  // namespace absenc::host
