// SPDX-License-Identifier: Apache-2.0
// Tests of sessions, mostly with a virtual T-format encoder, in virtual time.
#include "absenc/host/session.hpp"

#include <gtest/gtest.h>

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
