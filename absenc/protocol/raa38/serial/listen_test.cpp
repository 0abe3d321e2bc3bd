// SPDX-License-Identifier: Apache-2.0
// Tests of the reception of a stream, directly and by a Session.
#include "absenc/host/session.hpp"
#include "absenc/protocol/raa38/serial/bench_test.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::raa38::serial {
namespace {

using namespace testing;

constexpr Format fast{.mode = Mode::timing, .refresh_millihertz = 1'000'000};

/// Results that a host has emitted.
struct Results {
  std::vector<std::uint32_t> positions;
  std::vector<Time> times;
  std::vector<Error> errors;
  CommandResult end;
};

Results listen(Bench& bench, std::size_t count = SIZE_MAX) {
  Results results;
  Listen machine(bench.format);
  bench.run(machine, [&] {
    if (const Reading* reading = machine.reading()) {
      results.positions.push_back(static_cast<std::uint32_t>(reading->singleturn));
      results.times.push_back(reading->latched);
    } else {
      results.errors.push_back(machine.error());
    }
    return results.positions.size() + results.errors.size() < count;
  });
  results.end = raa38::testing::result_of<std::uint8_t>(machine);
  return results;
}

TEST(Raa38SerialListen, ReadsEveryFrameAtStreamRate) {
  Bench bench(fast);
  bench.shaft.spin(60, Time{});  // 60 rpm at 1000 frames per second: 16.384 counts per frame
  const Results results = listen(bench, 1000);
  ASSERT_EQ(results.positions.size(), 1000u);
  EXPECT_TRUE(results.errors.empty());
  EXPECT_EQ(bench.took, 999ms + 5 * line_of_tests.character());
  for (std::size_t i = 0; i < 1000; ++i) EXPECT_EQ(results.positions[i], (383 + 16'384 * i / 1000) % 16'384) << i;
  for (std::size_t i = 3; i < 1000; ++i) EXPECT_EQ(results.times[i] - results.times[i - 1], 1ms);
}

TEST(Raa38SerialListen, ReportsDamagedFrameOnceAndContinues) {
  Bench bench(fast);
  bench.encoder().set([](unsigned frame, Wire& reply) {
    if (frame == 5) reply[3] ^= 1;
    if (frame == 8) reply.pop_back();
  });
  const Results results = listen(bench, 20);
  ASSERT_EQ(results.errors.size(), 2u);
  EXPECT_EQ(results.errors[0], Error::bad_checksum);
  EXPECT_EQ(bench.encoder().answer_count(), 20u) << "nothing good was lost";
  EXPECT_TRUE(results.end.has("skipped=9")) << results.end.fields;
}

TEST(Raa38SerialListen, ExplainsWhyNoFrameIsValid) {
  struct Row {
    std::function<void(Wire&)> change;
    Error error;
    std::string_view words;
    std::string_view advice;
  };
  const std::vector<Row> rows{
      {[](Wire&) {}, Error::timeout, "does not transmit by itself", "mode=bus"},
      {[](Wire& reply) { reply[4] ^= 1; }, Error::bad_framing, "no two frames in a row", "parity"},
      {[](Wire& reply) {
         reply = {0xFF, 0x81, 0x40, 0x01, 0xC1};
       },
       Error::out_of_range, "more bits", "set bits"},
  };
  for (const Row& row : rows) {
    Bench bench(row.error == Error::timeout ? Format{.mode = Mode::bus} : fast);
    bench.encoder().set([&](unsigned, Wire& reply) { row.change(reply); });
    const Results results = listen(bench);
    EXPECT_TRUE(results.positions.empty());
    EXPECT_TRUE(ended(results.end, row.error, row.words));
    EXPECT_TRUE(says(results.end.words, row.advice));
  }
}

TEST(Raa38SerialListen, SpreadsTimesOfFramesReceivedTogether) {
  Listen machine(Format{});
  Wire wire;
  const auto feed = [&](std::uint32_t from, std::uint32_t frames, Time at) {
    wire.clear();
    for (std::uint32_t i = 0; i < frames; ++i) {
      const FrameBytes frame = encode_position({}, {from + i});
      wire.insert(wire.end(), frame.view().begin(), frame.view().end());
    }
    machine.feed({.kind = Event<std::uint8_t>::Kind::received, .at = at, .items = wire});
  };
  feed(1, 2, 10ms);
  while (machine.next(10ms).kind == Step<std::uint8_t>::Kind::emit) EXPECT_EQ(machine.reading()->latched, 10ms);
  feed(3, 4, 14ms);
  for (int i = 1; i <= 4; ++i) {
    ASSERT_EQ(machine.next(14ms).kind, Step<std::uint8_t>::Kind::emit);
    EXPECT_EQ(machine.reading()->singleturn, static_cast<unsigned>(2 + i));
    EXPECT_EQ(machine.reading()->latched, 10ms + i * 1ms);
  }
}

// ---- In a session

struct SessionBench {
  const Conversation<std::uint8_t>& read(host::Take take) { return *session.read(command, take); }

  Shaft14 shaft;
  Time clock{};
  VirtualEncoder encoder = [this] {
    shaft.spin(60, Time{});
    VirtualEncoder made(fast, shaft);
    made.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    return made;
  }();
  sim::SimPort<std::uint8_t> port{
      LinkKind::half_duplex,
      line_of_tests,
      encoder,
      {.now = [this] { return clock; }, .sleep_until = [this](Time time) { clock = std::max(clock, time); }}};
  std::vector<std::byte> storage = std::vector<std::byte>(serial_unit.host_storage);
  Options options = [] {
    Options all;
    EXPECT_EQ(resolve_options(serial_unit, {}, {}, all).kind, OptionError::Kind::none);
    return all;
  }();
  const Command& command = *find_command(serial_unit, Verb::read);
  host::Session<std::uint8_t> session{serial_unit, options, port, storage, host::EchoMode::automatic};
};

TEST(Raa38SerialSession, ReadsEveryFrame) {
  SessionBench bench;
  bench.read(host::Take::every);
  Time before = bench.read(host::Take::every).reading()->received;
  for (int i = 0; i < 200; ++i) {
    const Reading reading = *bench.read(host::Take::every).reading();
    EXPECT_EQ(reading.received - before, 1ms);
    before = reading.received;
  }
  EXPECT_EQ(bench.encoder.answer_count(), bench.session.counters().good);
}

TEST(Raa38SerialSession, TakesNewestFrameAfterPause) {
  SessionBench bench;
  bench.read(host::Take::newest);
  for (int i = 0; i < 20; ++i) {
    bench.clock += 50ms;
    const Reading reading = *bench.read(host::Take::newest).reading();
    EXPECT_GT(reading.received, bench.clock - 2ms);
    // The encoder begins a frame each millisecond, and a frame takes less than a millisecond.
    const auto frame = static_cast<std::uint64_t>(reading.received / 1ms);
    EXPECT_EQ(reading.singleturn, 16'384 * frame / 1000 % 16'384);
  }
}

TEST(Raa38SerialSession, ReportsTimeoutOfStream) {
  SessionBench bench;
  bench.read(host::Take::every);
  bench.encoder.power_off(bench.port.now());
  EXPECT_EQ(bench.read(host::Take::every).error(), Error::timeout);
  EXPECT_FALSE(bench.session.confirmed());
}

}  // namespace
}  // namespace absenc::raa38::serial
