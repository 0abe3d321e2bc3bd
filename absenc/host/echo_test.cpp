// SPDX-License-Identifier: Apache-2.0
// Tests the removal of an adapter's echo, in a session and in the filter alone.
#include "absenc/host/echo.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "absenc/host/session_bench_test.hpp"

namespace absenc::host {
namespace {

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
  // The temperature command reads memory and selects pages; the reply to a page select equals its request.
  const auto* temperature = bench.session->run(*find_command(bench.unit, Verb::temperature));
  EXPECT_EQ(temperature->error() == Error::none, GetParam().good);
}

INSTANTIATE_TEST_SUITE_P(Modes, Echo,
                         ::testing::Values(EchoRow{EchoMode::automatic, false, true},
                                           EchoRow{EchoMode::automatic, true, true}, EchoRow{EchoMode::on, true, true},
                                           EchoRow{EchoMode::off, false, true}, EchoRow{EchoMode::off, true, false},
                                           EchoRow{EchoMode::on, false, false}));

TEST(EchoFilter, DetectsModeAndKeepsIt) {
  for (const bool echo : {false, true}) {
    Bench bench(EchoMode::automatic);
    bench.port->set_echo(echo);
    EXPECT_EQ(bench.read().error(), Error::none);
    EXPECT_EQ(bench.session->echo().mode(), echo ? EchoMode::on : EchoMode::off);
  }
}

TEST(EchoFilter, ReportsLineWithOnlyTheEcho) {
  for (const EchoMode mode : {EchoMode::automatic, EchoMode::on}) {
    Bench bench(mode, always(sim::FaultKind::silence));
    bench.port->set_echo(true);
    EXPECT_EQ(bench.read().error(), Error::timeout);
    EXPECT_TRUE(bench.session->echo().only_echo());
  }
}

TEST(EchoFilter, ExtraByteIsNoEcho) {
  // The first reply has one extra byte, so that it is as long as an echo and a reply together.
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

TEST(EchoFilter, DetectsDisturbedEcho) {
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

TEST(EchoFilter, AnswerLimitAppliesAfterEcho) {
  Bench port_like(EchoMode::on);  // as on a real port, the echo is received after the `sent` event
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

// The reply to a page select has as many bytes as its request, and equals it.
TEST(EchoFilter, ReplyEqualToRequestIsNoLoneEcho) {
  Bench bench(EchoMode::automatic);
  EXPECT_EQ(bench.session->run(*find_command(bench.unit, Verb::temperature))->error(), Error::none);
}

}  // namespace
}  // namespace absenc::host
