// SPDX-License-Identifier: Apache-2.0
// Checks how the runner classifies echo, late replies and damaged frames of a stream.
#include "absenc/client/port/runner.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "absenc/capture/search/hypotheses.hpp"
#include "absenc/client/conform/conform_link.hpp"
#include "absenc/client/doctor/examine.hpp"
#include "absenc/client/doctor/lines_test.hpp"
#include "absenc/client/encoder/connection.hpp"
#include "absenc/client/port/virtual_link_test.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {
namespace {

using namespace std::chrono_literals;
using ByteList = std::vector<std::uint8_t>;

EncoderAddress with_faults(EncoderAddress address, std::vector<std::string> faults) {
  address.device.faults = std::move(faults);
  return address;
}

/// A runner with a virtual encoder on a line of characters.
struct Bench {
  explicit Bench(const std::string& text, const VirtualPort& way = {}, unsigned attempts = 1)
      : Bench(parse_address(text), way, attempts) {}
  explicit Bench(const EncoderAddress& to, const VirtualPort& way = {}, unsigned attempts = 1)
      : address(to), link(virtual_link(to, way)), runner(to, attempts) {
    runner.attach(*link.bytes, link.latency);
  }
  Attempted once() { return runner.once(*find_command(*address.unit, Verb::read)); }

  EncoderAddress address;
  Link link;
  Runner<std::uint8_t> runner;
};

// ---- Silence

TEST(Runner, SilenceIsATimeoutInEveryUnit) {
  for (const Unit* unit : all_units()) {
    if (unit->link != LinkKind::half_duplex && unit->link != LinkKind::full_duplex) continue;
    Bench bench(with_faults(parse_address(fmt::format("sim:{}", unit->id)), {"silence=1"}));
    const Attempted one = bench.once();
    EXPECT_EQ(one.error, Error::timeout) << unit->id;
    EXPECT_FALSE(one.heard) << unit->id;
  }
}

// ---- Echo

// The echo must be recognised from the first exchange on, although an echo of T-Format resembles the beginning of a
// reply.
TEST(Runner, TakesTheEchoFromTheFirstExchangeOn) {
  for (const bool echo : {false, true}) {
    for (const char* const mode : {"auto", "on", "off"}) {
      if ((mode == std::string("on")) != echo && mode != std::string("auto")) continue;
      Bench bench(std::string("sim:tformat?echo=") + mode, {.echo = echo});
      for (int i = 0; i < 3; ++i) {
        const Attempted one = bench.once();
        EXPECT_EQ(one.error, Error::none) << mode;
        EXPECT_EQ(one.exchange.request.bytes, (ByteList{0x1A}));
        EXPECT_EQ(one.exchange.reply.bytes.size(), 11u);
        EXPECT_EQ(one.raw.size(), echo ? 12u : 11u);
      }
    }
  }
}

TEST(Runner, AnEchoAloneIsNoReply) {
  Bench bench("sim:tformat?echo=auto&fault=silence=1", {.echo = true});
  const Attempted one = bench.once();
  EXPECT_EQ(one.error, Error::timeout);
  EXPECT_TRUE(one.heard);
  EXPECT_FALSE(one.answered);
  EXPECT_EQ(one.raw, one.exchange.request.bytes);
  EXPECT_TRUE(one.exchange.reply.bytes.empty());
}

TEST(Runner, AReplyThatComesTwiceIsNotTakenForAnEcho) {
  Bench bench("sim:tformat?echo=auto&fault=repeat=1");
  const Attempted one = bench.once();
  EXPECT_EQ(one.exchange.reply.bytes, one.raw);
  EXPECT_EQ(one.raw.front(), 0x1A);
  for (int i = 0; i < 2; ++i) {
    // waits until the line is silent: the fault sends each reply twice, and the second one would collide with the next
    // request
    bench.runner.settle(1ms, 10ms);
    EXPECT_EQ(bench.once().error, Error::none);
  }
  EXPECT_EQ(bench.runner.session().echo().mode(), host::EchoMode::off);
  EXPECT_EQ(bench.runner.overfull(), 2u) << "nobody has looked behind the third";
  EXPECT_EQ(bench.runner.late(), 0u);
}

TEST(Runner, TheEchoIsThatOfWhatWasSent) {
  Bench bench("sim:tformat?echo=on", {.echo = true});
  bench.once();
  bench.runner.edit = [](ByteList& request) { request = {0x55, 0x55, 0x55}; };
  const Attempted one = bench.once();
  EXPECT_EQ(one.exchange.request.bytes, (ByteList{0x55, 0x55, 0x55}));
  EXPECT_EQ((ByteList{one.raw.begin(), one.raw.begin() + 3}), one.exchange.request.bytes);
  EXPECT_EQ(one.exchange.reply.bytes, (ByteList{one.raw.begin() + 3, one.raw.end()}));
}

// ---- Lateness

EncoderAddress delayed(Time delay) {
  EncoderAddress address = with_faults(parse_address("sim:tformat?echo=off"), {"delay=1"});
  address.device.delay = delay;
  return address;
}

TEST(Runner, AReplyThatBeginsAfterItsLimitIsLate) {
  Bench bench(delayed(20ms));
  Attempted one = bench.once();
  EXPECT_EQ(one.error, Error::timeout);
  EXPECT_FALSE(one.is_late()) << "it is still under way";
  bench.runner.listen(50ms);
  bench.runner.keep_exchange(one);
  EXPECT_TRUE(one.is_late());
  EXPECT_EQ(one.exchange.reply.bytes.size(), 11u);
  EXPECT_EQ(bench.runner.late(), 1u);
  EXPECT_GT(bench.runner.lateness(), 20ms);
  EXPECT_LT(bench.runner.lateness(), 21ms);
}

// The late reply arrives while the host waits for a quiet line before its next request.
TEST(Runner, CountsALateReplyThatComesBeforeTheNextRequest) {
  Bench bench(delayed(120us));
  for (int i = 0; i < 10; ++i) EXPECT_EQ(bench.once().error, Error::timeout);
  EXPECT_GE(bench.runner.late(), 9u);
  EXPECT_LE(bench.runner.late(), 10u);
}

TEST(Runner, ARequestThatIsRepeatedAtOnceIsUnanswered) {
  Bench bench("sim:esl?fault=silence=1");
  const Attempted one = bench.once();
  EXPECT_EQ(one.error, Error::timeout);
  EXPECT_EQ(one.unanswered, bench.runner.port().requests - 1);
}

// ---- A line that is never silent

TEST(Runner, EndsByTheClockOfItsPort) {
  // raa38 must listen for a second to find that no good frame arrives
  const EncoderAddress address = parse_address("sim:raa38");
  auto port = std::make_shared<ScriptedPort<std::uint8_t>>();
  port->babble = {0x55, 0x12};
  Runner<std::uint8_t> runner(address);
  runner.attach(*port);
  std::vector<Attempted> all;
  const Command& read = *find_command(*address.unit, Verb::read);
  runner.repeat(
      {.count = 10, .limit = 100ms}, [&] { return runner.once(read); }, all);
  EXPECT_TRUE(all.empty());
  EXPECT_GE(port->now(), 200ms);
  EXPECT_LT(port->now(), 202ms);
  runner.port().deadline = port->now() + 50ms;
  EXPECT_THROW(runner.repeat(
                   {.count = 10, .limit = 100ms}, [&] { return runner.once(read); }, all),
               OutOfTime);
}

// ---- Streams

std::optional<EncoderAddress> streaming(const Unit& unit) {
  if (unit.streams == nullptr) return {};
  std::vector<std::vector<OptionText>> settings{{}};
  for (const Option& option : unit.options) {
    for (const std::string_view choice : option.choices) settings.push_back({{option.name, choice}});
    if (option.choices.empty() && option.minimum <= 500 && option.maximum >= 500) {
      settings.push_back({{option.name, "500"}});
    }
  }
  for (const auto& some : settings) {
    for (const Options& options : capture::likely_options(unit, some)) {
      if (!unit.streams(options)) continue;
      EncoderAddress address = parse_address("sim:" + std::string(unit.id));
      address.options = options;
      address.line = line_settings(unit, options);
      if (Bench(address).once().error == Error::none) return address;
      // The virtual encoders of some units send good frames only if another resolution is set.
      for (const std::size_t index : capture::resolution_options(unit)) {
        address.options.values[index] = std::min<std::int64_t>(unit.options[index].maximum, 16);
      }
      if (Bench(address).once().error == Error::none) return address;
    }
  }
  return {};
}

class Streams : public ::testing::TestWithParam<const Unit*> {
 protected:
  void SetUp() override {
    const auto found = streaming(*GetParam());
    if (!found) GTEST_SKIP() << "it does not transmit by itself";
    address = *found;
  }
  EncoderAddress address;
};

TEST_P(Streams, AGoodOneHasNoDamage) {
  Bench bench(address);
  for (int i = 0; i < 200; ++i) EXPECT_EQ(bench.once().error, Error::none);
  EXPECT_EQ(bench.runner.session().counters().discarded, 0u);
}

// If damaged frames surround a single good frame, the good frame is discarded as well.
TEST_P(Streams, EachDamagedFrameIsCounted) {
  for (const char* const fault : {"corrupt=0.02", "corrupt=0.3", "truncate=0.1", "drop=0.1"}) {
    Bench bench(with_faults(address, {fault}));
    std::uint64_t discarded = 0;
    for (int i = 0; i < 500; ++i) discarded += bench.once().discarded;
    const std::uint64_t damaged = bench.link.device->damaged_replies().value();
    // The last frames may not have arrived yet, and two truncated frames may together be as long as one frame, so the
    // counts may differ.
    EXPECT_GE((discarded + 2) * 5, damaged * 4) << fault;
    EXPECT_LE(discarded, 4 * damaged) << fault;
    EXPECT_EQ(bench.runner.session().counters().discarded, discarded);
  }
}

TEST_P(Streams, ReadingDoctorAndConformCountTheSame) {
  const EncoderAddress damaged = with_faults(address, {"corrupt=0.3"});
  constexpr std::size_t count = 100;

  std::vector<Attempted> by_hand;
  Bench bench(damaged);
  for (std::size_t i = 0; i < count; ++i) by_hand.push_back(bench.once());
  const std::uint64_t wanted = bench.runner.session().counters().discarded;
  const auto bad =
      std::count_if(by_hand.begin(), by_hand.end(), [](const Attempted& one) { return one.error != Error::none; });
  ASSERT_GT(wanted, 20u);

  const auto open = [](const EncoderAddress& to) { return virtual_link(to); };
  const std::unique_ptr<Connection> reading = Connection::make(damaged, open);
  reading->connect();
  while (reading->counters().good + reading->counters().bad() < count)
    static_cast<void>(reading->read(host::Take::every));
  EXPECT_NEAR(static_cast<double>(reading->counters().discarded), static_cast<double>(wanted), 3)
      << "a reading may take three results";

  const Surroundings surroundings{open, [](const std::string&) { return os::PortFacts{}; }};
  const Examination examination = examine(damaged, {.readings = count, .limit = 100s}, surroundings);
  EXPECT_FALSE(examination.healthy());
  const std::size_t all = count + wanted - static_cast<std::size_t>(bad);
  EXPECT_NE(examination.findings.at(0).evidence.find(std::to_string(wanted) + " of " + std::to_string(all)),
            std::string::npos)
      << examination.findings.at(0).evidence;
}

TEST_P(Streams, ConformSaysHowManyFramesWereDiscarded) {
  if (clauses_of(*address.unit).empty()) GTEST_SKIP() << "no clauses are known";
  const EncoderAddress damaged = with_faults(address, {"corrupt=0.3"});
  Bench bench(damaged);
  for (int i = 0; i < 100; ++i) bench.once();
  const std::string wanted = std::to_string(bench.runner.session().counters().discarded) + " frames of the stream";
  EXPECT_NE(conform(damaged, virtual_link(damaged), {.readings = 100}).report().find(wanted), std::string::npos)
      << wanted << "\n"
      << conform(damaged, virtual_link(damaged), {.readings = 100}).report();
}

INSTANTIATE_TEST_SUITE_P(Units, Streams, ::testing::ValuesIn(all_units().begin(), all_units().end()),
                         [](const auto& one) {
                           std::string name(one.param->id);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

// ---- Duration of conform

class ConformTime : public ::testing::TestWithParam<const Unit*> {};

TEST_P(ConformTime, OfALineWithAnyFaultEndsWithinTenSeconds) {
  const Unit& unit = *GetParam();
  if (clauses_of(unit).empty()) GTEST_SKIP() << "no clauses are known";
  for (const std::string_view fault : sim::fault_names) {
    EncoderAddress address = parse_address("sim:" + std::string(unit.id));
    address.device.faults = {std::string(fault) + "=1"};
    VirtualClock clock;
    const Conformance found = conform(address, virtual_link(address, {.clock = &clock}), {});
    EXPECT_LT(clock.time, 10s) << fault << "\n" << found.report();
  }
}

INSTANTIATE_TEST_SUITE_P(Units, ConformTime, ::testing::ValuesIn(all_units().begin(), all_units().end()),
                         [](const auto& one) {
                           std::string name(one.param->id);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(ConformTime, OfALineThatIsNeverSilentEndsWithinTenSeconds) {
  for (const Unit* unit : all_units()) {
    const bool characters = unit->link == LinkKind::half_duplex || unit->link == LinkKind::full_duplex;
    if (!characters || clauses_of(*unit).empty()) continue;
    auto port = std::make_shared<ScriptedPort<std::uint8_t>>();
    port->babble = {0x55, 0x12};
    const Conformance found = conform(parse_address("sim:" + std::string(unit->id)), link_to(port), {});
    EXPECT_LT(port->now(), 10s) << found.report();
  }
}

// The test of a damaged stream must end within 10 s of real time; it took 107 s before it had a time limit.
TEST(ConformTime, OfADamagedStreamEndsWithinTenSecondsOfOurs) {
  const Time begin = os::now();
  static_cast<void>(conform("sim:raa38?fault=corrupt=1"));
  EXPECT_LT(os::now() - begin, 10s);
}

}  // namespace
}  // namespace absenc::client
