// SPDX-License-Identifier: Apache-2.0
// Sessions, echo removal and the first reading, with a T-format encoder in virtual time.
#include "absenc/host/session.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "absenc/protocol/all.hpp"
#include "absenc/sim/faults.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::host {
namespace {

using namespace std::chrono_literals;
using Wire = std::vector<std::uint8_t>;

struct Still final : Shaft {
  [[nodiscard]] ShaftState at(Time) const override {
    return {.position = device != nullptr && device->answer_count() == wrong_answer ? wrong_position : position};
  }
  std::int64_t position = 0;
  const Device<std::uint8_t>* device = nullptr;
  std::uint64_t wrong_answer = UINT64_MAX;  // the number of one that says `wrong_position`
  std::int64_t wrong_position = 0;
};

/// A virtual encoder with faults, a port to it, and a session.
struct Bench {
  explicit Bench(EchoMode mode, sim::FaultRates rates = {}, unsigned attempts = 3,
                 const std::vector<OptionText>& settings = {}) {
    EXPECT_EQ(resolve_options(unit, {}, settings, options).kind, OptionError::Kind::none);
    device_storage.resize(unit.device_storage);
    host_storage.resize(unit.host_storage);
    device = unit.device(options, shaft, device_storage).bytes;
    device->power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    shaft.device = device;
    faulty = std::make_unique<sim::FaultyDevice>(*device, rates, 1);
    port = std::make_unique<sim::SimPort<std::uint8_t>>(unit.link, unit.line, *faulty);
    session = std::make_unique<Session<std::uint8_t>>(unit, options, *port, host_storage, mode, attempts);
  }
  const Conversation<std::uint8_t>& read() { return *session->read(*find_command(unit, Verb::read)); }
  /// How many answers a reading took.
  std::uint64_t answers_of_a_reading() {
    const std::uint64_t before = device->answer_count();
    EXPECT_EQ(read().error(), Error::none);
    return device->answer_count() - before;
  }
  /// Once, turned by so much.
  void answer_wrong(std::int64_t turned) {
    shaft.wrong_answer = device->answer_count();
    shaft.wrong_position = shaft.position + turned;
  }
  void pause(Time time) { port->line().run_until(port->line().now() + time); }
  [[nodiscard]] std::uint64_t refused() const {
    return session->counters().errors[static_cast<std::size_t>(Error::cross_check_failed)];
  }

  const Unit& unit = *find_unit("tformat");
  Options options;
  Still shaft;
  std::vector<std::byte> device_storage;
  std::vector<std::byte> host_storage;
  Device<std::uint8_t>* device = nullptr;
  std::unique_ptr<sim::FaultyDevice> faulty;
  std::unique_ptr<sim::SimPort<std::uint8_t>> port;
  std::unique_ptr<Session<std::uint8_t>> session;
};

sim::FaultRates always(sim::FaultKind kind) {
  sim::FaultRates rates;
  rates[kind] = 1;
  return rates;
}

TEST(Session, WithoutAConversationThereIsNoResult) {
  Bench bench(EchoMode::off);
  Session<std::uint8_t> session(bench.unit, bench.options, *bench.port, {}, EchoMode::off);
  EXPECT_EQ(session.run(*find_command(bench.unit, Verb::read)), nullptr) << "its storage is too small";
}

// ---- What waits behind ReplyGuard

TEST(ReplyGuard, ARequestWaitsAndWhatIsNoneDoesNot) {
  struct Asks final : Machine<std::uint8_t> {
    void feed(const Event<std::uint8_t>&) override {}
    Step<std::uint8_t> next(Time) override { return step; }
    Step<std::uint8_t> step;
  };
  using Kind = Step<std::uint8_t>::Kind;
  const Bench bench(EchoMode::off);
  const Wire bytes(17, 0x02);
  const auto first = [&](std::size_t size, Time at) {
    Asks asks;
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

/// Asks once, and hears what it is told.
struct Asking final : Machine<std::uint8_t> {
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
  static constexpr std::array<std::uint8_t, 1> request{0x02};
  bool sent = false;
  Wire heard;
};

// One that is owed may be what comes first; ten seconds later it is lost.
TEST(ReplyGuard, NothingIsOwedForMoreThanTenSeconds) {
  using Kind = Step<std::uint8_t>::Kind;
  const Bench bench(EchoMode::off);
  const Wire reply{0x02, 0x00, 0x11, 0x22, 0x01, 0x02 ^ 0x11 ^ 0x22 ^ 0x01};
  const auto heard = [&](Time pause) {
    ReplyGuard<std::uint8_t> guard;
    Time now = 1s;
    const auto send = [&](Asking& asking) {
      guard.attach(asking, bench.unit, bench.options, true);
      Step<std::uint8_t> step = guard.next(now);
      while (step.kind == Kind::wait) step = guard.next(now = step.at);
      EXPECT_EQ(step.kind, Kind::transfer);
      guard.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
    };
    Asking unanswered;
    send(unanswered);
    guard.feed({.kind = Event<std::uint8_t>::Kind::silence, .at = now + 3ms});
    guard.conclude();
    now += pause;
    Asking again;
    send(again);
    guard.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now + 100us, .items = reply});
    static_cast<void>(guard.next(now + 100us));
    return again.heard;
  };
  EXPECT_EQ(heard(9s), Wire{});
  EXPECT_EQ(heard(11s), reply);
}

TEST(ReplyGuard, ALineThatIsNeverQuietIsSpokenIntoAfterATenthOfASecond) {
  const Bench bench(EchoMode::off);
  ReplyGuard<std::uint8_t> guard;
  Asking asking;
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

// ---- Echo

struct EchoRow {
  EchoMode mode;
  bool echo;
  bool good;
};

class Echo : public ::testing::TestWithParam<EchoRow> {};

TEST_P(Echo, IsRemovedByCount) {
  Bench bench(GetParam().mode);
  bench.port->set_echo(GetParam().echo);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(bench.read().error() == Error::none, GetParam().good);
  }
  // Read, page select (its reply equals its request), memory read.
  const auto* temperature = bench.session->run(*find_command(bench.unit, Verb::temperature));
  EXPECT_EQ(temperature->error() == Error::none, GetParam().good);
}

INSTANTIATE_TEST_SUITE_P(Modes, Echo,
                         ::testing::Values(EchoRow{EchoMode::automatic, false, true},
                                           EchoRow{EchoMode::automatic, true, true}, EchoRow{EchoMode::on, true, true},
                                           EchoRow{EchoMode::off, false, true}, EchoRow{EchoMode::off, true, false},
                                           EchoRow{EchoMode::on, false, false}));

TEST(EchoFilter, FindsOutByItselfAndRemembers) {
  for (const bool echo : {false, true}) {
    Bench bench(EchoMode::automatic);
    bench.port->set_echo(echo);
    EXPECT_EQ(bench.read().error(), Error::none);
    EXPECT_EQ(bench.session->echo().mode(), echo ? EchoMode::on : EchoMode::off);
  }
}

TEST(EchoFilter, NamesALineOnWhichOnlyTheEchoComesBack) {
  for (const EchoMode mode : {EchoMode::automatic, EchoMode::on}) {
    Bench bench(mode, always(sim::FaultKind::silence));
    bench.port->set_echo(true);
    EXPECT_EQ(bench.read().error(), Error::timeout);
    EXPECT_TRUE(bench.session->echo().only_echo());
  }
}

TEST(EchoFilter, OneByteTooManyIsNotTakenForAnEcho) {
  // The first reply has a byte behind it that makes it as long as echo and reply.
  struct TooLong final : Machine<std::uint8_t> {
    explicit TooLong(Machine<std::uint8_t>& encoder) : device(encoder) {}
    void feed(const Event<std::uint8_t>& event) override { device.feed(event); }
    Step<std::uint8_t> next(Time now) override {
      Step<std::uint8_t> step = device.next(now);
      if (step.kind == Step<std::uint8_t>::Kind::transfer && !done) {
        out.assign(step.out.begin(), step.out.end());
        out.push_back(0);
        step.out = out;
        done = true;
      }
      return step;
    }
    Machine<std::uint8_t>& device;
    Wire out;
    bool done = false;
  };
  Bench bench(EchoMode::automatic);
  TooLong too_long(*bench.device);
  sim::SimPort<std::uint8_t> port(bench.unit.link, bench.unit.line, too_long);
  Session<std::uint8_t> session(bench.unit, bench.options, port, bench.host_storage, EchoMode::automatic);
  EXPECT_EQ(session.read(*find_command(bench.unit, Verb::read))->error(), Error::none);
  EXPECT_EQ(session.echo().mode(), EchoMode::off);
  EXPECT_EQ(session.counters().bad(), 0u) << "the reply before it is good";
}

TEST(EchoFilter, ADisturbedEchoIsNoticed) {
  Bench bench(EchoMode::on);
  std::vector<std::byte> storage(bench.unit.host_storage);
  for (const std::uint8_t echo : std::to_array<std::uint8_t>({0x1A, 0x1B})) {
    auto* read = bench.unit.host(bench.options, *find_command(bench.unit, Verb::read), {}, storage).bytes;
    EchoFilter filter(EchoMode::on);
    filter.attach(*read);
    ASSERT_EQ(filter.next(Time{}).kind, Step<std::uint8_t>::Kind::transfer);
    using Kind = Event<std::uint8_t>::Kind;
    const Wire wire{echo, 0x1A, 0, 0, 0, 0, 0x11, 0, 0, 0, 0, 0x0B};
    filter.feed({.kind = Kind::sent, .at = Time(1)});
    filter.feed({.kind = Kind::received, .at = Time(2), .items = wire});
    filter.feed({.kind = Kind::silence, .at = Time(3)});
    EXPECT_EQ(read->error() == Error::none && read->reading() != nullptr, echo == 0x1A);
  }
}

// The echo ends long before the encoder answers: that is no gap.
TEST(EchoFilter, TheAnswerTimeRunsOnAfterTheEcho) {
  Bench port_like(EchoMode::on);  // on a real port the echo comes after `sent`
  std::vector<std::byte> storage(port_like.unit.host_storage);
  auto* read = port_like.unit.host(port_like.options, *find_command(port_like.unit, Verb::read), {}, storage).bytes;
  EchoFilter filter(EchoMode::on);
  filter.attach(*read);
  const Wire echo{0x1A};
  const Time answer = filter.next(Time{}).answer;
  filter.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = Time(1)});
  filter.feed({.kind = Event<std::uint8_t>::Kind::received, .at = Time(2), .items = echo});
  EXPECT_GE(filter.next(Time(2)).gap, answer);

  for (const EchoMode mode : {EchoMode::on, EchoMode::automatic}) {
    sim::FaultRates rates = always(sim::FaultKind::delay);
    rates.delay = std::chrono::microseconds(50);
    Bench bench(mode, rates, 1);
    bench.port->set_echo(true);
    EXPECT_EQ(bench.read().error(), Error::none);
  }
}

// The reply to a page select has as many bytes as its request and equals it.
TEST(EchoFilter, AReplyLikeItsRequestIsNotTakenForAnEchoAlone) {
  Bench bench(EchoMode::automatic);
  EXPECT_EQ(bench.session->run(*find_command(bench.unit, Verb::temperature))->error(), Error::none);
}

// ---- Sessions

TEST(Session, RepeatsWhatMayBeRepeated) {
  Bench bench(EchoMode::off, always(sim::FaultKind::truncate));
  EXPECT_EQ(bench.session->run(*find_command(bench.unit, Verb::read))->error(), Error::wrong_length);
  EXPECT_EQ(bench.device->answer_count(), 3u);
  EXPECT_EQ(bench.session->counters().repeated, 2u);
  EXPECT_EQ(bench.session->counters().errors[static_cast<std::size_t>(Error::wrong_length)], 3u);
  bench.session->run(*find_command(bench.unit, Verb::zero));
  EXPECT_EQ(bench.device->answer_count(), 6u);  // one look at the position, tried three times; the reset itself never
}

// Request, 3 us, 11 characters: 51 us a reading are what the document allows.
TEST(Session, TellsItsStatisticsOfEveryAttempt) {
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
  good.read();  // twice, because it is the first
  EXPECT_EQ(statistics.latencies().count(), 2u);
  // The encoder's 3 us and 11 characters of 4 us.
  EXPECT_EQ(statistics.latencies().longest(), std::chrono::microseconds(47));
}

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
  EXPECT_EQ(bench.device->answer_count(), before + 3);  // the first could have been the late reply to one of before
}

// What explains the silence is told after each attempt, also when a late reply may still come.
TEST(Session, AReplyWithTheWrongKindOfIdentifierExplainsASilence) {
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
  bench.device->raise_alarms(0x04);  // counting_error
  const auto& reading = bench.read();
  EXPECT_EQ(reading.error(), Error::none);
  EXPECT_FALSE(reading.reading()->singleturn_valid());
  EXPECT_FALSE(bench.session->confirmed());
}

// ---- What is confirmed

constexpr std::int64_t turn = std::int64_t{1} << 32;
constexpr OptionText no_turns{"multiturn_bits", "0"};

TEST(SessionGuard, APositionThatNoShaftReachesIsReadAgain) {
  Bench bench(EchoMode::off);
  Statistics<std::uint8_t> statistics;
  bench.session->observe(&statistics);
  EXPECT_EQ(bench.answers_of_a_reading(), 2u) << "the first needs a second";
  EXPECT_EQ(bench.answers_of_a_reading(), 1u);
  bench.answer_wrong(turn / 32);  // farther than 10 000 rpm get meanwhile, and nearer than what counts as a jump
  EXPECT_EQ(bench.answers_of_a_reading(), 3u);
  EXPECT_TRUE(bench.session->confirmed());
  EXPECT_EQ(bench.refused(), 1u);
  EXPECT_EQ(bench.session->counters().good, 5u);
  EXPECT_EQ(statistics.kept(), 1u);
  EXPECT_EQ(statistics.bad(0).received.size(), 11u);
}

TEST(SessionGuard, AJumpNeedsASecondReadingOfItsOwn) {
  Bench bench(EchoMode::off);
  bench.read();
  bench.shaft.position += 5 * turn;
  EXPECT_EQ(bench.answers_of_a_reading(), 2u);
  EXPECT_TRUE(bench.session->confirmed());
  EXPECT_EQ(bench.refused(), 0u) << "it stays there";
  EXPECT_EQ(bench.answers_of_a_reading(), 1u);
}

TEST(SessionGuard, TheLimitIsTheOneThatIsSet) {
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

// Half a turn takes 3 ms at 10 000 rpm: after 20 ms a position may be anywhere.
TEST(SessionGuard, AfterAPauseThatTellsNothingASecondReadingDoes) {
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

TEST(SessionGuard, TurnsTellAfterALongPause) {
  Bench bench(EchoMode::off);
  bench.read();
  bench.pause(60s);
  EXPECT_EQ(bench.answers_of_a_reading(), 1u);
  bench.pause(60s);
  bench.answer_wrong(20'000 * turn);
  EXPECT_EQ(bench.answers_of_a_reading(), 3u);
}

// A reading takes 55 us, in which such a shaft turns nearly once: a second one tells no more than the first.
TEST(SessionGuard, WhereNoSecondReadingTellsHalfATurnIsStillRefused) {
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

TEST(SessionGuard, NothingIsConfirmedThatAgreesWithNothing) {
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

// It was read once; what says itself that it does not hold needs no second, and is not confirmed.
TEST(SessionGuard, AnInvalidPositionOfAKnownEncoderIsShownAtOnce) {
  Bench bench(EchoMode::off);
  bench.read();
  bench.device->raise_alarms(0x04);  // counting_error
  EXPECT_EQ(bench.answers_of_a_reading(), 1u);
  EXPECT_FALSE(bench.session->confirmed());
  bench.device->lower_alarms(0x04);
  const auto* const clear = find_command(bench.unit, Verb::clear_alarms);
  ASSERT_EQ(bench.session->run(*clear)->error(), Error::none);
  EXPECT_EQ(bench.answers_of_a_reading(), 2u);
  EXPECT_TRUE(bench.session->confirmed());
}

// ---- FirstReading

constexpr Reading reading_at(std::uint64_t singleturn, std::uint64_t multiturn, Time latched) {
  return {.singleturn = singleturn,
          .multiturn = multiturn,
          .singleturn_bits = 17,
          .multiturn_bits = 16,
          .singleturn_valid_bits = 17,
          .multiturn_valid = true,
          .latched = latched};
}

constexpr Reading of_bits(unsigned bits, std::uint64_t singleturn, Time latched) {
  return {.singleturn = singleturn, .singleturn_bits = bits, .singleturn_valid_bits = bits, .latched = latched};
}

constexpr bool agree(FirstReading first, const Reading& one, const Reading& other) {
  return !first.confirms(one) && first.confirms(other);
}

TEST(FirstReading, AllowsNoMoreThanTheFastestShaft) {
  // 6000 rpm are 100 turns a second: 13 107 counts in 1 ms.
  const auto confirmed = [](std::uint64_t singleturn, std::uint64_t multiturn) {
    return agree(FirstReading(6000), reading_at(0, 0, {}), reading_at(singleturn, multiturn, 1ms));
  };
  EXPECT_TRUE(confirmed(13'107, 0));
  EXPECT_FALSE(confirmed(13'120, 0));
  EXPECT_TRUE(confirmed(131'072 - 13'107, 65'535));  // backwards over both wraps
  EXPECT_FALSE(confirmed(0, 1));
  EXPECT_FALSE(confirmed(0, 32'768));
}

TEST(FirstReading, HasALimitEvenWhereNobodySaysOne) {
  const auto confirmed = [](std::uint64_t singleturn, Time later) {
    return agree(FirstReading(0), of_bits(13, 0, {}), of_bits(13, singleturn, later));
  };
  EXPECT_TRUE(confirmed(136, 100us)) << "a sixtieth of a turn";
  EXPECT_FALSE(confirmed(150, 100us));
  EXPECT_FALSE(confirmed(1024, 100us));
}

TEST(FirstReading, HalfATurnIsNeverConfirmed) {
  for (const Time later : {Time(10ms), Time(1s), Time(24h), never}) {
    EXPECT_FALSE(agree(FirstReading(10'000), of_bits(13, 7, {}), of_bits(13, 7 + 4096, later)));
    EXPECT_FALSE(agree(FirstReading(10'000), of_bits(13, 7, {}), of_bits(13, 7 + 3841, later)));
    EXPECT_TRUE(agree(FirstReading(10'000), of_bits(13, 7, {}), of_bits(13, 7 + 3840, later)));
  }
}

// 12 000 rpm are 200 turns a second: 0.2 of a turn in 1 ms.
TEST(FirstReading, AShaftThatIsFasterIsSeenByItsThirdPosition) {
  FirstReading first(6000);
  EXPECT_FALSE(first.confirms(of_bits(13, 0, 0ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 1638, 1ms)));
  EXPECT_TRUE(first.confirms(of_bits(13, 3277, 2ms)));
  EXPECT_TRUE(first.confirms(of_bits(13, 4915, 3ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 3415, 4ms))) << "damaged";
  EXPECT_FALSE(first.confirms(of_bits(13, 0, 5ms)));
}

TEST(FirstReading, AShaftThatIsMuchFasterIsNotBelieved) {
  for (const std::uint64_t step : {1638u, 3276u, 3500u}) {  // of 819 in a millisecond
    FirstReading first(6000);
    EXPECT_FALSE(first.confirms(of_bits(15, 0, 0ms)));
    EXPECT_FALSE(first.confirms(of_bits(15, 4 * step, 1ms)));
    EXPECT_EQ(first.confirms(of_bits(15, 8 * step, 2ms)), step <= 3276);
  }
}

TEST(FirstReading, TwoDamagedPositionsMakeNoSpeed) {
  FirstReading first(6000);
  EXPECT_FALSE(first.confirms(of_bits(13, 100, 0ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 100 + 2048, 1ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 100, 2ms)));
  EXPECT_TRUE(first.confirms(of_bits(13, 100, 3ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 100 + 1024, 4ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 100 + 4096, 5ms)));
}

TEST(FirstReading, ComparesTheTurnsWhereBothHaveThem) {
  const Reading with = reading_at(5, 5, {});
  Reading without = with;
  without.multiturn_valid = false;
  EXPECT_FALSE(agree(FirstReading(6000), with, without));
  EXPECT_FALSE(agree(FirstReading(6000), without, with)) << "nothing is known of the turns before";
  EXPECT_TRUE(agree(FirstReading(6000), without, without));
}

TEST(FirstReading, TakesPositionsOf64Bits) {
  EXPECT_TRUE(agree(FirstReading(1), of_bits(64, ~std::uint64_t{0}, {}), of_bits(64, 3, {})));
  EXPECT_FALSE(agree(FirstReading(1), of_bits(64, ~std::uint64_t{0}, {}), of_bits(64, 4, {})));
  EXPECT_FALSE(agree(FirstReading(1), of_bits(64, 0, {}), of_bits(64, std::uint64_t{1} << 63, never)));
  EXPECT_TRUE(agree(FirstReading(10'000), of_bits(64, 0, {}), of_bits(64, std::uint64_t{15} << 59, 3s)));
}

TEST(FirstReading, OfACarriageByItsOwnSpeed) {
  // 1 m/s: 1000 counts of 1 um in a millisecond.
  const FirstReading first(Reach::of({.mm_s = 1000}, {.singleturn_bits = 26, .multiturn_bits = 0, .unit_um = 1}));
  EXPECT_TRUE(agree(first, of_bits(26, 0, {}), of_bits(26, 1004, 1ms)));
  EXPECT_FALSE(agree(first, of_bits(26, 0, {}), of_bits(26, 1006, 1ms)));
}

static_assert(agree(FirstReading(6000), of_bits(17, 1, {}), of_bits(17, 2, {})));

TEST(FirstReading, WaitsUntilTheEncoderIsReady) {
  FirstReading first(6000);
  Reading starting = reading_at(5, 5, {});
  starting.ready = false;
  EXPECT_FALSE(first.confirms(starting));
  EXPECT_FALSE(first.confirms(reading_at(5, 5, {})));
  EXPECT_FALSE(first.confirms(starting));
  EXPECT_FALSE(first.confirms(reading_at(5, 5, {})));
  EXPECT_TRUE(first.confirms(reading_at(5, 5, {})));
}

}  // namespace
}  // namespace absenc::host
