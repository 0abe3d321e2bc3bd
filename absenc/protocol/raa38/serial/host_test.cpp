// SPDX-License-Identifier: Apache-2.0
// Tests of the host's requests, its commands `zero` and `scan`, and the virtual encoder.
#include "absenc/protocol/raa38/serial/bench_test.hpp"

namespace absenc::raa38::serial {
namespace {

using namespace testing;

constexpr Format timing{.mode = Mode::timing, .zeroing = Zeroing::line};
constexpr Format handshake{.mode = Mode::handshake, .zeroing = Zeroing::line};
constexpr Format bus{.mode = Mode::bus, .zeroing = Zeroing::command};
constexpr Format bus_with_line{.mode = Mode::bus, .zeroing = Zeroing::line};

const auto frame_time = 5 * line_of_tests.character();

Format with(Format format, auto member, auto value) {
  format.*member = value;
  return format;
}

TEST(Raa38SerialHandshake, ReadsOneFramePerPulse) {
  Bench bench(handshake);
  const CommandResult read = bench.run_command("position");
  EXPECT_EQ(read.reading->singleturn, 383u);
  EXPECT_EQ(read.reading->latched, Time{}) << "at the edge";
  EXPECT_EQ(read.took, virtual_acquisition + frame_time) << "T1";
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
  // The encoder may send its frame after a time T3 that is shorter than the host's pulse on CLK.
  EXPECT_TRUE(ended(Bench(with(handshake, &Format::acquisition, Time(1))).run_command("position"), Error::none));
}

TEST(Raa38SerialHandshake, UsesOrderedT3) {
  Bench bench(with(handshake, &Format::acquisition, Time(250ms)));
  EXPECT_EQ(bench.run_command("position").took, 250ms + frame_time);
  const CommandResult unknowing = bench.run_command(handshake, "position");
  EXPECT_TRUE(ended(unknowing, Error::timeout, "no frame followed the pulse"));
  EXPECT_TRUE(says(unknowing.words, "CLK"));
}

TEST(Raa38SerialHandshake, AllowsOrderedFrameDuration) {
  const Format slow = with(handshake, &Format::transmission, Time(60ms));
  Bench bench(slow);
  const CommandResult read = bench.run_command("position");
  EXPECT_TRUE(ended(read, Error::none));
  EXPECT_GT(read.took, virtual_acquisition + 4 * slow.transmission / 5) << "T1 - T3";
  EXPECT_LE(read.took, virtual_acquisition + slow.transmission);
  EXPECT_TRUE(ended(bench.run_command(handshake, "position"), Error::wrong_length));
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
}

TEST(Raa38SerialHandshake, CharacterGapAllows1200Baud) {
  using Event = absenc::Event<std::uint8_t>;
  Talk read(handshake, "position");
  ASSERT_EQ(read->next(Time{}).kind, Step<std::uint8_t>::Kind::pulse);
  read->feed({.kind = Event::Kind::sent, .at = trigger_width});
  read->feed({.kind = Event::Kind::received, .at = 1ms, .items = {&header, 1}});
  EXPECT_GT(read->next(1ms).gap, LineSettings{.rate = 1200}.character());
}

TEST(Raa38SerialHandshake, AcceptsFrameDuringPulse) {
  using Event = absenc::Event<std::uint8_t>;
  const FrameBytes frame = encode_position(handshake, {383});
  Talk read(handshake, "position");
  ASSERT_EQ(read->next(Time{}).kind, Step<std::uint8_t>::Kind::pulse);
  read->feed({.kind = Event::Kind::received, .at = 5us, .items = frame.view()});
  read->feed({.kind = Event::Kind::sent, .at = trigger_width});
  ASSERT_NE(read->reading(), nullptr);
  EXPECT_EQ(read->reading()->singleturn, 383u);
}

TEST(Raa38SerialBus, ReadsPolledUnitInEitherForm) {
  for (const SecondByte form : {SecondByte::automatic, SecondByte::fixed, SecondByte::echo}) {
    const CommandResult read = Bench(with(bus, &Format::second_byte, form)).run_command("position");
    EXPECT_EQ(read.reading->singleturn, 383u);
    EXPECT_EQ(read.took, (3 + 5) * line_of_tests.character() + virtual_acquisition);
  }
}

TEST(Raa38SerialBus, ExplainsEachWrongReply) {
  struct Row {
    Wire reply;
    Error error;
    std::string_view words;
  };
  const Row rows[]{
      {{}, Error::timeout, "scan"},
      {{0xFF, 0x81, 0x01}, Error::wrong_length, "bits"},
      {{0xFF, 0x81, 0x01, 0xAB, 0xCD, 0xF9}, Error::wrong_length, "bits"},
      {{0xFF, 0x81, 0x01, 0x7F, 0x01}, Error::bad_checksum, "two encoders"},
      {{0xFF, 0xB2, 0x01, 0x7F, 0x31}, Error::unexpected_reply, "another unit"},
      {{0xFE, 0x81, 0x01, 0x7F, 0xFF}, Error::unexpected_reply, "no frame"},
      {{0xFF, 0x81, 0x40, 0x00, 0xC0}, Error::out_of_range, "bits"},
  };
  for (const Row& row : rows) {
    Bench bench(bus);
    bench.encoder().set([&](unsigned, Wire& reply) { reply = row.reply; });
    EXPECT_TRUE(ended(bench.run_command("position"), row.error, row.words));
  }
}

TEST(Raa38SerialHandshake, DoesNotBlameSecondEncoderForBadChecksum) {
  Bench bench(handshake);
  bench.encoder().set([](unsigned, Wire& reply) { reply[4] ^= 1; });
  const CommandResult read = bench.run_command("position");
  EXPECT_TRUE(ended(read, Error::bad_checksum));
  EXPECT_FALSE(says(read.words, "scan")) << "nobody else is there: " << read.words;
}

TEST(Raa38SerialBus, RejectsCollisionOfTwoUnits) {
  Bench bench(bus);
  bench.add_twin(with(bus, &Format::second_byte, SecondByte::echo));
  // the frames FF 81 01 7F 00 and FF B1 01 7E 2F of two encoders collide
  EXPECT_TRUE(ended(bench.run_command("position"), Error::bad_checksum));
}

// Checks that an encoder on the bus takes no bytes BC AA inside another encoder's frame for a request.
TEST(Raa38SerialBus, IgnoresRequestStartInsideFrame) {
  Bench bench(with(bus, &Format::bits, 16u));
  bench.add(with(bench.format, &Format::unit, std::uint8_t{2}));
  bench.shaft.start.position = std::int64_t{0xBCAA} << 16;
  EXPECT_EQ(bench.position(), 0xBCAAu);
  EXPECT_EQ(bench.position(), 0xBCAAu);
  EXPECT_EQ(bench.encoders.back().answer_count(), 0u);
}

// ---- Zero

class Raa38SerialZero : public ::testing::TestWithParam<Format> {};

TEST_P(Raa38SerialZero, SetsZeroAndReadsItBack) {
  Bench bench(GetParam());
  const CommandResult zero = bench.run_command("zero");
  EXPECT_TRUE(ended(zero, Error::none));
  EXPECT_TRUE(zero.has("before=383 singleturn=0")) << zero.fields;
  EXPECT_EQ(bench.encoder().memory_version(), 1u);
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
  bench.encoder().power_off(bench.line.now());
  bench.encoder().power_on(bench.line.now(), Device<std::uint8_t>::PowerOn::skip);
  bench.put(400);
  if (GetParam().mode == Mode::timing) return;
  EXPECT_EQ(bench.position(), 17u) << "it survives power off";
}

TEST_P(Raa38SerialZero, ReportsZeroWithoutEffect) {
  Bench bench(with(GetParam(), &Format::zeroing, Zeroing::none));
  const CommandResult zero = bench.run_command(GetParam(), "zero");
  EXPECT_TRUE(ended(zero, Error::cross_check_failed, "CLR"));
  EXPECT_GE(zero.took, zero_limit);
  if (GetParam().mode == Mode::timing) return;
  EXPECT_LE(bench.encoder().answer_count(), static_cast<std::uint64_t>(3 + zero_limit / zero_poll));
}

TEST_P(Raa38SerialZero, RefusesWhileShaftTurns) {
  // The procedure notices even a shaft that turns at only 2 rpm, because time passes between its two readings.
  for (const int rpm : {60, 2}) {
    Bench bench(GetParam());
    bench.shaft.spin(rpm, Time{});
    EXPECT_TRUE(ended(bench.run_command("zero"), Error::not_still, "nothing was changed")) << rpm;
    EXPECT_EQ(bench.encoder().memory_version(), 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, Raa38SerialZero, ::testing::Values(timing, handshake, bus, bus_with_line));

TEST(Raa38SerialZeroing, UsesNumberOfZeroUnit) {
  Bench bench(with(bus, &Format::zero_unit, 7));
  EXPECT_TRUE(ended(bench.run_command("zero"), Error::none));
  bench.put(5000);
  EXPECT_TRUE(ended(bench.run_command(bus, "zero"), Error::cross_check_failed));
}

TEST(Raa38SerialZeroing, ExplainsMissingOptions) {
  EXPECT_TRUE(ended(Bench({}).run_command("zero"), Error::unsupported, "zero clearing"));
  EXPECT_TRUE(ended(Bench({.mode = Mode::handshake, .zeroing = Zeroing::command}).run_command("zero"),
                    Error::invalid_argument, "set mode=bus, or zeroing=line for a wire to CLR"));
}

TEST(Raa38SerialZeroing, ReportsPositionThatCannotBeReadBack) {
  for (const Format& format : {bus, timing}) {
    const bool streams = format.mode == Mode::timing;
    Bench bench(format);
    bench.encoder().set([&](unsigned frame, Wire& reply) {
      if (frame > (streams ? 4 : 1)) reply.assign(streams ? 1 : 0, 0x00);
    });
    const Error error = streams ? Error::bad_framing : Error::timeout;
    EXPECT_TRUE(ended(bench.run_command("zero"), error, "could not be read back"));
  }
}

TEST(Raa38SerialZeroing, SetsNoZeroWithoutValidFrames) {
  const std::pair<Error, std::function<void(Wire&)>> rows[]{
      {Error::timeout, [](Wire&) {}},
      {Error::bad_framing, [](Wire& reply) { reply[4] ^= 1; }},
      {Error::out_of_range,
       [](Wire& reply) {
         reply = Wire{0xFF, 0x81, 0x40, 0x01, 0xC1};
       }},
  };
  for (const auto& [error, change] : rows) {
    Bench bench(error == Error::timeout ? bus : timing);
    bench.encoder().set([&how = change](unsigned, Wire& reply) { how(reply); });
    const CommandResult zero = bench.run_command(timing, "zero");
    EXPECT_TRUE(ended(zero, error));
    EXPECT_EQ(zero.took, listen_limit);
    EXPECT_EQ(bench.encoder().memory_version(), 0u);
  }
}

// ---- Scan

TEST(Raa38SerialScan, FindsUnitsAndClashes) {
  Bench bench(bus);
  for (const std::uint8_t unit : std::to_array<std::uint8_t>({3, 9, 15})) bench.add(with(bus, &Format::unit, unit));
  bench.add_twin({.second_byte = SecondByte::echo, .mode = Mode::bus, .unit = 9});
  EXPECT_EQ(bench.run_command("scan").fields,
            "encoder_address=1 clash=0 singleturn=383 second_byte=129 "
            "encoder_address=3 clash=0 singleturn=383 second_byte=129 encoder_address=9 clash=1 "
            "encoder_address=15 clash=0 singleturn=383 second_byte=129 ");
  for (const Tampered& encoder : bench.encoders) EXPECT_EQ(encoder.violation_count(), 0u);
}

TEST(Raa38SerialScan, RepeatsRequestAfterDamagedReply) {
  Bench bench(bus);
  bench.encoder().set([](unsigned frame, Wire& reply) {
    if (frame == 0) reply[4] ^= 1;
  });
  EXPECT_TRUE(bench.run_command("scan").has("clash=0"));
}

TEST(Raa38SerialScan, StopsOnEndlessNoise) {
  Talk scan(bus, "scan");
  EXPECT_LT(raa38::testing::time_with_noise(*scan), 1500ms);
  EXPECT_TRUE(says(scan->detail(), "without a pause"));
}

TEST(Raa38SerialScan, ReportsNoUnitAndStreamingEncoder) {
  EXPECT_TRUE(ended(Bench(handshake).run_command("scan"), Error::timeout, "no number from 0 to F"));
  EXPECT_TRUE(
      ended(Bench(timing).run_command("scan"), Error::unexpected_reply, "something comes although nobody asks"));
}

// ---- Rules that the virtual encoder checks

/// Sends two pulses on CLK, or two requests, with a pause between them.
struct Twice final : Machine<std::uint8_t> {
  Twice(Time pulse_width, Time second, Wire bytes = {}) : width(pulse_width), due(second), request(std::move(bytes)) {}
  void feed(const Event<std::uint8_t>&) override {}
  Step<std::uint8_t> next(Time now) override {
    using Kind = Step<std::uint8_t>::Kind;
    if (count == 2 || (count == 1 && now < due)) return {.at = count == 1 ? due : never};
    ++count;
    if (!request.empty()) return {.kind = Kind::transfer, .out = request};
    return {.kind = Kind::pulse, .wire = ExtraWire::trigger, .width = width};
  }
  Time width;
  Time due;
  Wire request;
  int count = 0;
};

TEST(Raa38SerialDevice, ReportsEachBrokenRule) {
  const auto violation = [](const Format& format, Twice host) -> std::string {
    Bench bench(format);
    bench.run(host, [] { return true; });
    return bench.encoder().violations().empty() ? "" : std::string(bench.encoder().violations()[0].rule);
  };
  EXPECT_EQ(violation(handshake, {10us, 10ms}), "");
  EXPECT_EQ(violation(handshake, {9us, 10ms}), "pulse on CLK shorter than 10 us (T2)");
  EXPECT_EQ(violation(handshake, {10us, 300us}), "pulse on CLK before the last frame was out (T1)");
  const Format slow = with(bus, &Format::acquisition, Time(5ms));
  EXPECT_EQ(violation(slow, {{}, 10ms, {0xBC, 0xAA, 0xB1}}), "");
  EXPECT_EQ(violation(slow, {{}, 2ms, {0xBC, 0xAA, 0xB2}}), "");
  EXPECT_EQ(violation(slow, {{}, 2ms, {0xBC, 0xAA, 0xB1}}), "request during the encoder's transmission");
}

TEST(Raa38SerialDevice, DoesNotReportRequestThatWasReceivedLate) {
  const Format slow = with(with(bus, &Format::acquisition, Time(5ms)), &Format::transmission, Time(2ms));
  const Wire request{0xBC, 0xAA, 0xB1};
  for (const auto& [late, rules] : {std::pair(7ms, 1u), {8ms, 0u}}) {
    Shaft14 shaft;
    VirtualEncoder encoder(slow, shaft);
    encoder.power_on(Time{}, VirtualEncoder::PowerOn::skip);
    encoder.feed({.kind = Event<std::uint8_t>::Kind::received, .at = 20ms, .items = request});
    encoder.next(20ms);
    encoder.feed({.kind = Event<std::uint8_t>::Kind::received, .at = 30ms, .items = request, .late = late});
    EXPECT_EQ(encoder.violation_count(), rules) << late.count();
  }
}

TEST(Raa38SerialDevice, IgnoresRequestsOfOtherUnits) {
  const auto reply_to = [](const Wire& request) {
    Bench bench(bus);
    sim::testing::RawHost host(request, 50ms, 10ms, Time{});
    return bench.run(host).reply;
  };
  for (const Wire& request : {Wire{0xBC, 0xAA, 0xB2}, Wire{0xBC, 0xAA, 0xD1}, Wire{0xBC, 0xAB, 0xB1}, Wire{0xBC, 0xAA},
                              Wire{0xAA, 0xB1}, Wire{0xBC, 0xAA, 0xC1}}) {
    EXPECT_EQ(reply_to(request), Wire{});
  }
  EXPECT_EQ(reply_to({0x00, 0xBC, 0xBC, 0xAA, 0xB1}), (Wire{0xFF, 0x81, 0x01, 0x7F, 0x00}))
      << "garbage before a request is no reason";
}

}  // namespace
}  // namespace absenc::raa38::serial
