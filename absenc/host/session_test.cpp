// SPDX-License-Identifier: Apache-2.0
// Tests of ReplyGuard and of sessions, mostly with a virtual T-format encoder, in virtual time.
#include "absenc/host/session.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include "absenc/host/session_bench_test.hpp"

namespace absenc::host {
namespace {

TEST(Session, WithoutAConversationThereIsNoResult) {
  Bench bench(EchoMode::off);
  Session<std::uint8_t> session(bench.unit, bench.options, *bench.port, {}, EchoMode::off);
  EXPECT_EQ(session.run(*find_command(bench.unit, Verb::read)), nullptr) << "its storage is too small";
}

// ---- ReplyGuard

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
  Bytes request = position;
  bool sent = false;
  Wire heard;
};

/// A guard to which requests are given one after another.
struct GuardedLine {
  using Kind = Step<std::uint8_t>::Kind;
  /// Gives `asking` to the guard, and waits until its request is sent.
  void send(OneRequest& asking) {
    guard.attach(asking, bench.unit, bench.options, true);
    Step<std::uint8_t> step = guard.next(now);
    while (step.kind == Kind::wait) step = guard.next(now = step.at);
    EXPECT_EQ(step.kind, Kind::transfer);
    guard.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
  }
  /// Sends a request that is not answered, and waits for `pause`.
  void ask_in_vain(Time pause) {
    OneRequest unanswered;
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
  const Bench bench{EchoMode::off};
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
  using Kind = Step<std::uint8_t>::Kind;
  const Unit& unit = *find_unit("raa38-modbus");
  Options options;
  const std::array<OptionText, 1> slow{{{"baud", "2400"}}};
  ASSERT_EQ(resolve_options(unit, {}, slow, options).kind, OptionError::Kind::none);
  constexpr std::array<std::uint8_t, 4> other{0xFF, 0xA0, 0x40, 0x38};
  constexpr std::array<std::uint8_t, 8> request{0x01, 0x03, 0x00, 0x00, 0x00, 0x01, 0x84, 0x0A};
  const Wire reply{0x01, 0x03, 0x02, 0x01, 0x7F, 0xF8, 0x34};
  ReplyGuard<std::uint8_t> guard;
  Time now = 1s;
  const auto send = [&](OneRequest& asking, Bytes bytes) {
    asking.request = bytes;
    guard.attach(asking, unit, options, true);
    Step<std::uint8_t> step = guard.next(now);
    while (step.kind == Kind::wait) step = guard.next(now = step.at);
    guard.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
  };
  const auto receive = [&](Bytes items, Time after) {
    now += after;
    guard.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = items});
    return guard.next(now).kind;
  };
  OneRequest unanswered;
  send(unanswered, other);
  now += 3ms;
  guard.feed({.kind = Event<std::uint8_t>::Kind::silence, .at = now});
  guard.conclude();
  OneRequest answered;
  send(answered, request);
  // six bytes, 20 ms apart: 120 ms
  for (const std::uint8_t& byte : reply) EXPECT_EQ(receive({&byte, 1}, 20ms), Kind::wait);
  EXPECT_EQ(answered.heard, reply);

  guard.conclude();
  OneRequest disturbed;
  disturbed.request = request;
  guard.attach(disturbed, unit, options, true);
  const Time begin = now;
  const Wire noise{0x55};
  EXPECT_EQ(guard.next(now).kind, Kind::wait);
  while (receive(noise, 100us) == Kind::wait && now < begin + 5s) continue;
  const Time characters = 64 * line_settings(unit, options).character();
  EXPECT_GE(now, begin + characters);
  EXPECT_LT(now, begin + characters + 10ms);
}

// ---- Sessions

TEST(Session, RepeatsRepeatableCommands) {
  Bench bench(EchoMode::off, always(sim::FaultKind::truncate));
  EXPECT_EQ(bench.session->run(*find_command(bench.unit, Verb::read))->error(), Error::wrong_length);
  EXPECT_EQ(bench.device->answer_count(), 3u);
  EXPECT_EQ(bench.session->counters().repeated, 2u);
  EXPECT_EQ(bench.session->counters().errors[static_cast<std::size_t>(Error::wrong_length)], 3u);
  bench.session->run(*find_command(bench.unit, Verb::zero));
  // the zero command has sent three more position requests, but not the request that sets the zero
  EXPECT_EQ(bench.device->answer_count(), 6u);
}

TEST(Session, FeedsStatisticsWithEveryAttempt) {
  Bench bad(EchoMode::off, always(sim::FaultKind::corrupt));
  Statistics<std::uint8_t> statistics;
  bad.session->observe(&statistics);
  bad.read();
  EXPECT_EQ(statistics.kept(), 3u);
  EXPECT_EQ(statistics.bad(0).sent.size(), 1u);
  EXPECT_EQ(statistics.bad(0).received.size(), 11u);
  EXPECT_EQ(statistics.latencies().count(), 0u);

  Bench good(EchoMode::off);
  good.session->observe(&statistics);
  good.read();  // sends two requests, because a second position must confirm the first one
  EXPECT_EQ(statistics.latencies().count(), 2u);
  // The latency is 3 us of the encoder and 11 characters of 4 us each.
  EXPECT_EQ(statistics.latencies().longest(), std::chrono::microseconds(47));
}

// The document permits 51 us for a reading: request, 3 us, 11 characters.
TEST(Session, LeavesTheBusNoIdleTime) {
  Bench bench(EchoMode::off);
  constexpr int readings = 1000;
  for (int i = 0; i < readings; ++i) ASSERT_EQ(bench.read().error(), Error::none);
  const Time allowed = readings * (bench.unit.line.character() * 12 + std::chrono::microseconds(3));
  const double use = static_cast<double>(allowed.count()) / static_cast<double>(bench.port->now().count());
  std::printf("%.4f of the readings a second that the document's times allow\n", use);
  EXPECT_GE(use, 0.99);
}

TEST(Session, ShowsTheSecondOfTwoReadingsThatAgree) {
  Bench bench(EchoMode::off);
  EXPECT_EQ(bench.read().error(), Error::none);
  EXPECT_EQ(bench.device->answer_count(), 2u);
  EXPECT_TRUE(bench.session->confirmed());
  bench.read();
  EXPECT_EQ(bench.device->answer_count(), 3u);
  bench.faulty->set_rates(always(sim::FaultKind::silence));
  EXPECT_EQ(bench.read().error(), Error::timeout);
  EXPECT_FALSE(bench.session->confirmed());
  bench.faulty->set_rates({});
  const auto before = bench.device->answer_count();
  EXPECT_EQ(bench.read().error(), Error::none);
  // The first reply could be the late reply to an earlier request, so the session sends the request again.
  EXPECT_EQ(bench.device->answer_count(), before + 3);
}

TEST(Session, ReplyWithWrongKindOfIdentifierExplainsTimeout) {
  struct Extended final : Machine<CanFrame> {
    void feed(const Event<CanFrame>& event) override {
      if (event.kind == Event<CanFrame>::Kind::received) due = true;
    }
    Step<CanFrame> next(Time) override {
      if (!std::exchange(due, false)) return {.at = never};
      return {.kind = Step<CanFrame>::Kind::transfer, .out = {&reply, 1}};
    }
    CanFrame reply{.id = 0x120, .extended = true, .size = 8};
    bool due = false;
  };
  const Unit& unit = *find_unit("raa38-can");
  Options options;
  ASSERT_EQ(resolve_options(unit, {}, {}, options).kind, OptionError::Kind::none);
  Extended device;
  sim::SimPort<CanFrame> port(unit.link, unit.line.with_some_rate(), device);
  std::vector<std::byte> storage(unit.host_storage);
  Session<CanFrame> session(unit, options, port, storage, EchoMode::automatic);
  EXPECT_EQ(session.read(*find_command(unit, Verb::read))->error(), Error::unexpected_reply);
  EXPECT_GT(session.counters().repeated, 0u);
}

TEST(Session, AnInvalidPositionIsNeverConfirmed) {
  Bench bench(EchoMode::off);
  bench.device->raise_alarms(0x04);  // 0x04 is the alarm bit counting_error
  const auto& reading = bench.read();
  EXPECT_EQ(reading.error(), Error::none);
  EXPECT_FALSE(reading.reading()->singleturn_valid());
  EXPECT_FALSE(bench.session->confirmed());
}

TEST(Session, ReadsInvalidPositionAgainOnlyForAShortTime) {
  Bench bench(EchoMode::off, {}, 3, {{"singleturn_bits", "25"}}, "endat");
  bench.device->raise_alarms(0x01);  // the words with the alarms are read behind each position: some 40 ms
  EXPECT_FALSE(bench.read().reading()->singleturn_valid());
  EXPECT_LT(bench.port->now(), 100ms);
  EXPECT_GT(bench.port->now(), 60ms) << "it is read a second time";
}

// ---- Resolution that the encoder is asked for

/// The place of an encoder on the line, in which the test exchanges encoders.
struct Socket final : Machine<std::uint8_t> {
  void feed(const Event<std::uint8_t>& event) override { encoder->feed(event); }
  Step<std::uint8_t> next(Time now) override { return encoder->next(now); }
  Machine<std::uint8_t>* encoder = nullptr;
};

/// A session that asks virtual EnDat encoders of 25 and of 13 bits, of which the first is connected, for the
/// resolution.
struct AskingBench {
  AskingBench()
      : wide(EchoMode::off, {}, 3, {{"singleturn_bits", "25"}}, "endat"),
        narrow(EchoMode::off, {}, 3, {{"singleturn_bits", "13"}, {"version", "2.2"}}, "endat") {
    socket.encoder = wide.device;
    EXPECT_EQ(resolve_options(wide.unit, {}, {}, options).kind, OptionError::Kind::none);
    port.emplace(wide.unit.link, line_settings(wide.unit, options), socket);
    session.emplace(wide.unit, options, *port, wide.host_storage, EchoMode::off);
  }
  /// Reads once, expects a position of `bits` bits, and returns the number of exchanges that this took.
  std::uint64_t exchanges(unsigned bits) {
    const std::uint64_t before = wide.device->answer_count() + narrow.device->answer_count();
    const Conversation<std::uint8_t>& read = *session->read(*find_command(wide.unit, Verb::read));
    EXPECT_EQ(read.error(), Error::none);
    EXPECT_EQ(read.reading() != nullptr ? read.reading()->singleturn_bits : 0, bits);
    return wide.device->answer_count() + narrow.device->answer_count() - before;
  }

  Bench wide;
  Bench narrow;
  Socket socket;
  Options options;
  std::optional<sim::SimPort<std::uint8_t>> port;
  std::optional<Session<std::uint8_t>> session;
};
constexpr std::uint64_t asking = 8;  // two selections, five words, position

TEST(SessionLearns, AsksForResolutionOnce) {
  AskingBench bench;
  EXPECT_EQ(bench.exchanges(25), asking + 1) << "a second position confirms the first";
  const Time begin = bench.port->now();
  for (int i = 0; i < 10; ++i) EXPECT_EQ(bench.exchanges(25), 1u);
  EXPECT_LT(bench.port->now() - begin, 1ms);
}

TEST(SessionLearns, AsksAgainAfterAPauseOrAChange) {
  AskingBench bench;
  bench.exchanges(25);
  bench.port->line().run_until(bench.port->now() + 499ms);
  EXPECT_EQ(bench.exchanges(25), 2u) << "after a pause a second position confirms the first";
  bench.port->line().run_until(bench.port->now() + 501ms);
  EXPECT_EQ(bench.exchanges(25), asking + 1);
  bench.session->run(*find_command(bench.wide.unit, "reset"));
  EXPECT_EQ(bench.exchanges(25), asking + 1);
  bench.session->doubt();
  EXPECT_EQ(bench.exchanges(25), asking + 1);
}

TEST(SessionLearns, NoticesExchangedEncoder) {
  AskingBench bench;
  bench.exchanges(25);
  bench.socket.encoder = bench.narrow.device;
  bench.exchanges(13);
  EXPECT_GT(bench.session->counters().bad(), 0u) << "the reply of another length has a wrong checksum";
  EXPECT_EQ(bench.exchanges(13), 1u);
}

// ---- Confirmation

constexpr std::int64_t turn = std::int64_t{1} << 32;
constexpr OptionText no_turns{"multiturn_bits", "0"};

TEST(SessionGuard, ReadsImpossiblePositionAgain) {
  Bench bench(EchoMode::off);
  Statistics<std::uint8_t> statistics;
  bench.session->observe(&statistics);
  EXPECT_EQ(bench.answers_of_a_reading(), 2u) << "the first needs a second";
  EXPECT_EQ(bench.answers_of_a_reading(), 1u);
  // this wrong position is farther away than the shaft can move at 10 000 rpm, but too near to count as a jump
  bench.answer_wrong(turn / 32);
  EXPECT_EQ(bench.answers_of_a_reading(), 3u);
  EXPECT_TRUE(bench.session->confirmed());
  EXPECT_EQ(bench.refused(), 1u);
  EXPECT_EQ(bench.session->counters().good, 5u);
  EXPECT_EQ(statistics.kept(), 1u);
  EXPECT_EQ(statistics.bad(0).received.size(), 11u);
}

TEST(SessionGuard, JumpNeedsASecondReading) {
  Bench bench(EchoMode::off);
  bench.read();
  bench.shaft.position += 5 * turn;
  EXPECT_EQ(bench.answers_of_a_reading(), 2u);
  EXPECT_TRUE(bench.session->confirmed());
  EXPECT_EQ(bench.refused(), 0u) << "it stays there";
  EXPECT_EQ(bench.answers_of_a_reading(), 1u);
}

TEST(SessionGuard, UsesTheGivenLimit) {
  Bench bench(EchoMode::off);
  bench.read();
  bench.answer_wrong(turn / 1000);
  EXPECT_EQ(bench.answers_of_a_reading(), 1u) << "10 000 rpm get that far";
  bench.session->set_speed_limit({.rpm = 100});
  EXPECT_EQ(bench.answers_of_a_reading(), 2u) << "it begins again";
  bench.answer_wrong(turn / 1000);
  EXPECT_EQ(bench.answers_of_a_reading(), 3u);
  EXPECT_EQ(bench.refused(), 1u);
}

// Half a turn takes 3 ms at 10 000 rpm, so after 20 ms any position is possible.
TEST(SessionGuard, LongPauseNeedsASecondReading) {
  Bench bench(EchoMode::off, {}, 3, {no_turns});
  bench.read();
  bench.pause(2ms);
  EXPECT_EQ(bench.answers_of_a_reading(), 1u);
  bench.pause(20ms);
  EXPECT_EQ(bench.answers_of_a_reading(), 2u);
  EXPECT_TRUE(bench.session->confirmed());
  bench.pause(20ms);
  bench.answer_wrong(turn / 10);
  EXPECT_EQ(bench.answers_of_a_reading(), 3u) << "the two after it agree";
  EXPECT_EQ(bench.read().reading()->singleturn, 0u);
  bench.session->set_speed_limit({.rpm = 1000});
  bench.read();
  bench.pause(20ms);
  EXPECT_EQ(bench.answers_of_a_reading(), 1u) << "half a turn takes 30 ms";
}

TEST(SessionGuard, TurnsConfirmAfterALongPause) {
  Bench bench(EchoMode::off);
  bench.read();
  bench.pause(60s);
  EXPECT_EQ(bench.answers_of_a_reading(), 1u);
  bench.pause(60s);
  bench.answer_wrong(20'000 * turn);
  EXPECT_EQ(bench.answers_of_a_reading(), 3u);
}

// A reading takes 51 us, in which this shaft can turn nearly once, so a second reading cannot confirm the first.
TEST(SessionGuard, RefusesHalfATurnIfSecondReadingTakesTooLong) {
  Bench bench(EchoMode::off, {}, 3, {no_turns});
  bench.session->set_speed_limit({.rpm = 1'000'000});
  EXPECT_EQ(bench.answers_of_a_reading(), 2u);
  bench.pause(20ms);
  EXPECT_EQ(bench.answers_of_a_reading(), 1u);
  bench.answer_wrong(turn / 4);
  EXPECT_EQ(bench.answers_of_a_reading(), 1u);
  bench.read();
  bench.answer_wrong(turn * 12 / 25);
  EXPECT_EQ(bench.answers_of_a_reading(), 2u);
  EXPECT_EQ(bench.refused(), 0u) << "nobody knows which was wrong";
}

TEST(SessionGuard, ConfirmsNothingWithoutAgreement) {
  Bench bench(EchoMode::off);
  struct Wild final : Shaft {
    [[nodiscard]] ShaftState at(Time) const override {
      return {.position =
                  static_cast<std::int64_t>(device->answer_count() * device->answer_count() * 0x9E37'79B9'7F4A'7C15)};
    }
    const Device<std::uint8_t>* device = nullptr;
  };
  Wild wild;
  std::vector<std::byte> storage(bench.unit.device_storage);
  Device<std::uint8_t>* device = bench.unit.device(bench.options, wild, storage).bytes;
  wild.device = device;
  device->power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  sim::SimPort<std::uint8_t> port(bench.unit.link, bench.unit.line, *device);
  Session<std::uint8_t> session(bench.unit, bench.options, port, bench.host_storage);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(session.read(*find_command(bench.unit, Verb::read))->error(), Error::none);
    EXPECT_FALSE(session.confirmed());
  }
  EXPECT_EQ(device->answer_count(), 3u * 11);
}

TEST(SessionGuard, ReturnsInvalidPositionOfKnownEncoderAtOnce) {
  Bench bench(EchoMode::off);
  bench.read();
  bench.device->raise_alarms(0x04);  // 0x04 is the alarm bit counting_error
  EXPECT_EQ(bench.answers_of_a_reading(), 1u);
  EXPECT_FALSE(bench.session->confirmed());
  bench.device->lower_alarms(0x04);
  const auto* const clear = find_command(bench.unit, Verb::clear_alarms);
  ASSERT_EQ(bench.session->run(*clear)->error(), Error::none);
  EXPECT_EQ(bench.answers_of_a_reading(), 2u);
  EXPECT_TRUE(bench.session->confirmed());
}

}  // namespace
}  // namespace absenc::host
