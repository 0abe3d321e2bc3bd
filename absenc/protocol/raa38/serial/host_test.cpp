// SPDX-License-Identifier: Apache-2.0
// Host against virtual encoder in virtual time.
#include <gtest/gtest.h>

#include "absenc/protocol/raa38/serial/bench_test.hpp"

namespace absenc::raa38::serial {
namespace {

using namespace testing;
using Wire = std::vector<std::uint8_t>;

constexpr Format timing{.mode = Mode::timing, .zeroing = Zeroing::line};
constexpr Format handshake{.mode = Mode::handshake, .zeroing = Zeroing::line};
constexpr Format bus{.mode = Mode::bus, .zeroing = Zeroing::command};

const auto frame_time = 5 * line_of_tests.character();

Talk converse(Bench& bench, std::string_view command = "position") {
  Talk talk(bench.settings, command);
  bench.run(talk);
  return talk;
}

TEST(RaaHandshake, AFrameForEachPulse) {
  Bench bench(handshake);
  const Talk read = converse(bench);
  ASSERT_EQ(read.error(), Error::none);
  EXPECT_EQ(read.reading()->singleturn, 383u);
  EXPECT_EQ(read.reading()->latched, Time{}) << "at the edge";
  EXPECT_EQ(bench.took, virtual_acquisition + frame_time) << "T1";
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
}

TEST(RaaHandshake, T3IsAsOrdered) {
  Format slow = handshake;
  slow.acquisition = 250ms;
  Bench bench(slow);
  EXPECT_EQ(converse(bench).error(), Error::none);
  EXPECT_EQ(bench.took, 250ms + frame_time);
  Talk unknowing(handshake, "position");
  bench.run(unknowing);
  EXPECT_EQ(unknowing.error(), Error::timeout);
  EXPECT_EQ(unknowing.detail(), "no frame followed the pulse");
  EXPECT_NE(unknowing.advice().find("CLK"), std::string_view::npos);
}

TEST(RaaHandshake, AFrameTakesAsLongAsOrdered) {
  Format slow = handshake;
  slow.transmission = 60ms;
  Bench bench(slow);
  EXPECT_EQ(converse(bench).error(), Error::none);
  EXPECT_GT(bench.took, virtual_acquisition + 4 * slow.transmission / 5) << "T1 - T3";
  EXPECT_LE(bench.took, virtual_acquisition + slow.transmission);
  Talk unknowing(handshake, "position");
  bench.run(unknowing);
  EXPECT_EQ(unknowing.error(), Error::wrong_length);
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
}

TEST(RaaHandshake, TheWholeFrameMayComeDuringThePulse) {
  using Event = absenc::Event<std::uint8_t>;
  const FrameBytes frame = encode_position(handshake, {383});
  Talk read(handshake, "position");
  ASSERT_EQ(read.next(Time{}).kind, Step<std::uint8_t>::Kind::pulse);
  read.feed({.kind = Event::Kind::received, .at = 5us, .items = frame.view()});
  read.feed({.kind = Event::Kind::sent, .at = trigger_width});
  ASSERT_NE(read.reading(), nullptr);
  EXPECT_EQ(read.reading()->singleturn, 383u);
}

TEST(RaaHandshake, T3MayBeShorterThanThePulse) {
  Format fast = handshake;
  fast.acquisition = Time(1);
  Bench bench(fast);
  EXPECT_EQ(converse(bench).error(), Error::none);
}

TEST(RaaBus, TheUnitThatIsAskedAnswersInEitherForm) {
  for (const SecondByte form : {SecondByte::automatic, SecondByte::fixed, SecondByte::echo}) {
    Format settings = bus;
    settings.second_byte = form;
    Bench bench(settings);
    EXPECT_EQ(converse(bench).reading()->singleturn, 383u);
    EXPECT_EQ(bench.took, (3 + 5) * line_of_tests.character() + virtual_acquisition);
  }
}

TEST(RaaBus, AWrongReplyIsAnErrorThatSaysWhy) {
  struct Row {
    Wire reply;
    Error error;
    std::string_view words;
  };
  const std::vector<Row> rows{
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
    bench.device().set([&](unsigned, Wire& reply) { reply = row.reply; });
    const Talk read = converse(bench);
    EXPECT_EQ(text_of(read.error()).name, text_of(row.error).name);
    EXPECT_EQ(read.reading(), nullptr);
    EXPECT_TRUE(report(read).numbers.empty());
    const std::string words = std::string(read.detail()) + " " + std::string(read.advice());
    EXPECT_NE(words.find(row.words), std::string::npos) << text_of(row.error).name << ": " << words;
  }
}

TEST(RaaBus, TwoWithOneNumberAreNeverAPosition) {
  Bench bench(bus);
  Format other = bus;
  other.second_byte = SecondByte::echo;
  bench.add(other).memory()[0] = 1;
  const Talk read = converse(bench);
  EXPECT_EQ(read.error(), Error::bad_checksum);  // FF 81 01 7F 00 and FF B1 01 7E 2F
  EXPECT_EQ(read.reading(), nullptr);
}

// BC AA may stand in a frame, though no sum makes a request of it.
TEST(RaaBus, TheBeginOfARequestInsideAFrameOfAnotherIsNone) {
  Format wide = bus;
  wide.bits = 16;
  Bench bench(wide);
  Format other = wide;
  other.unit = 2;
  bench.add(other);
  bench.shaft.start.position = std::int64_t{0xBCAA} << 16;
  EXPECT_EQ(converse(bench).reading()->singleturn, 0xBCAAu);
  EXPECT_EQ(converse(bench).reading()->singleturn, 0xBCAAu);
  EXPECT_EQ(bench.encoders.back().answered(), 0u);
}

TEST(RaaReading, SpeedRefusesSwappedBytes) {
  for (Format settings : {handshake, bus}) {
    settings.maximum_rpm = 6000;
    Bench bench(settings);
    EXPECT_EQ(converse(bench).error(), Error::none);
    EXPECT_EQ(bench.encoder().answered(), 2u);
    bench.shaft.put(0, 0x1201);
    bench.device().set([](unsigned frame, Wire& reply) {
      if (frame == 1) std::swap(reply[2], reply[3]);
    });
    const Talk read = converse(bench);
    EXPECT_EQ(read.error(), Error::cross_check_failed);
    EXPECT_EQ(read.reading(), nullptr);
  }
}

// ---- Zero

class RaaZero : public ::testing::TestWithParam<Format> {};

TEST_P(RaaZero, IsSetAndReadBack) {
  Bench bench(GetParam());
  const Talk zero = converse(bench, "zero");
  ASSERT_EQ(zero.error(), Error::none) << zero.detail();
  Fields fields = report(zero);
  EXPECT_EQ(fields.numbers["before"], std::vector<std::int64_t>{383});
  EXPECT_EQ(fields.numbers["singleturn"], std::vector<std::int64_t>{0});
  EXPECT_EQ(bench.encoder().writes(), 1u);
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
  bench.encoder().power_off(bench.line.now());
  bench.encoder().power_on(bench.line.now(), Device<std::uint8_t>::PowerOn::skip);
  bench.shaft.put(0, 400);
  Format reads = GetParam();
  reads.zeroing = Zeroing::none;
  if (reads.mode == Mode::timing) return;
  Talk read(reads, "position");
  EXPECT_EQ(bench.run(read).reading()->singleturn, 17u) << "it survives power off";
}

TEST_P(RaaZero, ThatHadNoEffectIsTold) {
  Bench bench(GetParam());
  Format deaf = GetParam();
  deaf.zeroing = Zeroing::none;
  bench.encoders.back() = VirtualEncoder(deaf, bench.shaft);
  bench.encoder().power_on(bench.line.now(), Device<std::uint8_t>::PowerOn::skip);
  const Talk zero = converse(bench, "zero");
  EXPECT_EQ(zero.error(), Error::cross_check_failed);
  EXPECT_NE(zero.advice().find("CLR"), std::string_view::npos);
  EXPECT_GE(bench.took, zero_limit);
  EXPECT_TRUE(report(zero).numbers.empty());
}

constexpr Format bus_with_line{.mode = Mode::bus, .zeroing = Zeroing::line};

std::string zero_name(const ::testing::TestParamInfo<Format>& info) {
  constexpr std::array<const char*, 3> modes{"timing", "handshake", "bus"};
  const std::string mode = modes[static_cast<std::size_t>(info.param.mode)];
  return mode + (info.param.zeroing == Zeroing::line ? "_line" : "_command");
}
INSTANTIATE_TEST_SUITE_P(Modes, RaaZero, ::testing::Values(timing, handshake, bus, bus_with_line), zero_name);

TEST(RaaZeroing, TheNumberBehindCMayBeAnother) {
  Format settings = bus;
  settings.zero_unit = 7;
  Bench bench(settings);
  EXPECT_EQ(converse(bench, "zero").error(), Error::none);
  Talk wrong(bus, "zero");
  bench.shaft.put(0, 5000);
  EXPECT_EQ(bench.run(wrong).error(), Error::cross_check_failed);
}

TEST(RaaZeroing, SaysWhatIsMissing) {
  EXPECT_EQ(Talk({}, "zero").error(), Error::unsupported);
  const Talk zero({.mode = Mode::handshake, .zeroing = Zeroing::command}, "zero");
  EXPECT_EQ(zero.error(), Error::invalid_argument);
  EXPECT_EQ(zero.advice(), "set mode=bus, or zeroing=line for a wire to CLR");
}

TEST(RaaZeroing, APositionThatCannotBeReadBackIsTold) {
  Bench bench(bus);
  bench.device().set([](unsigned frame, Wire& reply) {
    if (frame > 1) reply.clear();
  });
  const Talk zero = converse(bench, "zero");
  EXPECT_EQ(zero.error(), Error::timeout);
  EXPECT_NE(zero.detail().find("could not be read back"), std::string_view::npos);
}

TEST_P(RaaZero, IsNotSetWhileTheShaftTurns) {
  Bench bench(GetParam());
  bench.shaft.spin(60, Time{});
  const Talk zero = converse(bench, "zero");
  EXPECT_EQ(zero.error(), Error::invalid_argument);
  EXPECT_NE(zero.detail().find("turning"), std::string_view::npos);
  EXPECT_EQ(bench.encoder().writes(), 0u);
}

TEST(RaaZeroing, AStreamWithoutFramesIsNoZero) {
  struct Row {
    std::function<void(Wire&)> change;
    Error error;
  };
  const std::vector<Row> rows{
      {[](Wire&) {}, Error::timeout},
      {[](Wire& reply) { reply[4] ^= 1; }, Error::bad_framing},
      {[](Wire& reply) {
         reply = {0xFF, 0x81, 0x40, 0x01, 0xC1};
       },
       Error::out_of_range},
  };
  for (const Row& row : rows) {
    Bench bench(row.error == Error::timeout ? bus : timing);
    bench.device().set([&](unsigned, Wire& reply) { row.change(reply); });
    Talk zero(timing, "zero");
    EXPECT_EQ(text_of(bench.run(zero).error()).name, text_of(row.error).name);
    EXPECT_EQ(bench.took, listen_limit);
    EXPECT_EQ(bench.encoder().writes(), 0u);
  }
}

TEST(RaaZeroing, AStreamThatEndsAfterwardsIsTold) {
  Bench bench(timing);
  bench.device().set([](unsigned frame, Wire& reply) {
    if (frame > 4) reply.assign(1, 0x00);
  });
  const Talk zero = converse(bench, "zero");
  EXPECT_TRUE(bench.finished);
  EXPECT_EQ(zero.error(), Error::bad_framing);
  EXPECT_NE(zero.detail().find("could not be read back"), std::string_view::npos);
}

// ---- Scan

TEST(RaaScan, FindsEverybodyAndClashes) {
  Bench bench(bus);
  for (const std::uint8_t unit : std::to_array<std::uint8_t>({3, 9, 9, 15})) {
    Format settings = bus;
    settings.unit = unit;
    settings.second_byte = bench.encoders.size() == 3 ? SecondByte::echo : SecondByte::automatic;
    bench.add(settings).memory()[0] = bench.encoders.size() == 3 ? 1 : 0;
  }
  const Talk scan = converse(bench, "scan");
  ASSERT_EQ(scan.error(), Error::none);
  Fields fields = report(scan);
  EXPECT_EQ(fields.numbers["encoder_address"], (std::vector<std::int64_t>{1, 3, 9, 15}));
  EXPECT_EQ(fields.numbers["clash"], (std::vector<std::int64_t>{0, 0, 1, 0}));
  EXPECT_EQ(fields.numbers["singleturn"], (std::vector<std::int64_t>{383, 383, 383}));
  for (const VirtualEncoder& encoder : bench.encoders) EXPECT_EQ(encoder.violation_count(), 0u);
}

TEST(RaaScan, AsksADamagedAnswerAgain) {
  Bench bench(bus);
  bench.device().set([](unsigned frame, Wire& reply) {
    if (frame == 0) reply[4] ^= 1;
  });
  Fields fields = report(converse(bench, "scan"));
  EXPECT_EQ(fields.numbers["clash"], std::vector<std::int64_t>{0});
}

TEST(RaaScan, ALineThatIsNeverSilentIsGivenUpAtOnce) {
  Talk scan(bus, "scan");
  EXPECT_LT(raa38::testing::time_with_noise(scan), 1500ms);
  EXPECT_NE(scan.detail().find("without a pause"), std::string_view::npos);
}

TEST(RaaScan, NobodyAndSomebodyWhoTransmitsByHimself) {
  Bench handshaking(handshake);
  EXPECT_EQ(converse(handshaking, "scan").error(), Error::timeout);
  Bench streaming(timing);
  const Talk scan = converse(streaming, "scan");
  EXPECT_EQ(scan.error(), Error::unexpected_reply);
  EXPECT_EQ(scan.detail(), "something comes although nobody asks");
}

// ---- The rules of the virtual encoder

/// Two pulses on CLK.
class Pulser final : public Machine<std::uint8_t> {
 public:
  Pulser(Time width, Time second) : width_(width), second_(second) {}
  void feed(const Event<std::uint8_t>&) override {}
  Step<std::uint8_t> next(Time now) override {
    if (now >= second_ && pulses_ == 1) return pulse();
    if (pulses_ == 0) return pulse();
    return {.at = pulses_ == 1 ? second_ : never};
  }

 private:
  Step<std::uint8_t> pulse() {
    ++pulses_;
    return {.kind = Step<std::uint8_t>::Kind::pulse, .width = width_, .line = Line::trigger};
  }
  Time width_;
  Time second_;
  int pulses_ = 0;
};

TEST(RaaDevice, ListsTheRulesThatTheHostBreaks) {
  const auto violation = [](Time width, Time second) -> std::string {
    Bench bench(handshake);
    Pulser pulser(width, second);
    bench.line.attach(sim::Role::host, pulser);
    bench.line.run_until(50ms);
    return bench.encoder().violations().empty() ? "" : std::string(bench.encoder().violations()[0].rule);
  };
  EXPECT_EQ(violation(10us, 10ms), "");
  EXPECT_EQ(violation(9us, 10ms), "pulse on CLK shorter than 10 us (T2)");
  EXPECT_EQ(violation(10us, 300us), "pulse on CLK before the last frame was out (T1)");
}

TEST(RaaDevice, AnswersNoRequestThatIsNotItsOwn) {
  for (const Wire& request : {Wire{0xBC, 0xAA, 0xB2}, Wire{0xBC, 0xAA, 0xD1}, Wire{0xBC, 0xAB, 0xB1}, Wire{0xBC, 0xAA},
                              Wire{0xAA, 0xB1}, Wire{0xBC, 0xAA, 0xC1}}) {
    Bench bench(bus);
    sim::testing::RawHost host(request, 50ms, 10ms, Time{});
    bench.run(host);
    EXPECT_TRUE(host.reply.empty());
  }
  Bench bench(bus);
  sim::testing::RawHost host({0x00, 0xBC, 0xBC, 0xAA, 0xB1}, 50ms, 10ms, Time{});
  bench.run(host);
  EXPECT_EQ(host.reply, (Wire{0xFF, 0x81, 0x01, 0x7F, 0x00})) << "garbage before a request is no reason";
}

}  // namespace
}  // namespace absenc::raa38::serial
