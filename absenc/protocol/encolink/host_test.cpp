// SPDX-License-Identifier: Apache-2.0
// Host conversations against the virtual AksIM-2 in virtual time, on both wires.
#include "absenc/protocol/encolink/host.hpp"

#include <gtest/gtest.h>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/encolink/bench_test.hpp"

namespace absenc::encolink {
namespace {

using testing::Bench;
using testing::Told;
using PowerOn = Device<std::uint8_t>::PowerOn;

class EncolinkHost : public ::testing::TestWithParam<Wire> {
 protected:
  const Wire wire = GetParam();
};

INSTANTIATE_TEST_SUITE_P(Wires, EncolinkHost, ::testing::Values(Wire::uart, Wire::spi),
                         [](const auto& test) { return test.param == Wire::uart ? "uart" : "spi"; });

TEST(EncolinkHostUart, ReadsAPositionInTheTimeOfTheWire) {
  Bench bench;
  const Told read = bench.run("position");
  ASSERT_EQ(read.error, Error::none);
  EXPECT_EQ(bench.took, (2 + 7) * 10us + answer_time);
  ASSERT_TRUE(read.reading);
  EXPECT_EQ(read.reading->singleturn, 0x12345u);
  EXPECT_EQ(read.reading->multiturn, 7u);
  EXPECT_EQ(read.reading->latched, 20us);
  EXPECT_EQ(read.reading->received, 95us);
}

TEST(EncolinkHostSpi, ThePositionIsTakenWhenNcsFalls) {
  Bench bench(testing::single, Wire::spi);
  bench.pass(1ms);
  const Told read = bench.run("position");
  ASSERT_EQ(read.error, Error::none);
  EXPECT_EQ(read.reading->latched, 1ms);
  EXPECT_EQ(read.reading->received, 1ms + spi_lead + 40us);
  EXPECT_EQ(bench.took, spi_lead + 40us);
}

TEST_P(EncolinkHost, ReadsPositionsOneAfterTheOther) {
  Bench bench(testing::single, wire);
  for (std::uint32_t i = 1; i < 100; ++i) {
    bench.shaft.put(0, 10 * i);
    const Told read = bench.run("position");
    ASSERT_EQ(read.error, Error::none);
    ASSERT_EQ(read.reading->singleturn, 10 * i);
    ASSERT_EQ(bench.frames, 1u);
    bench.pass(spi_pause);
  }
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST_P(EncolinkHost, WhatIsNotKnownIsAskedFirst) {
  for (const Format& real : {testing::single, testing::multi, Format{17, 16}}) {
    Bench bench(real, wire);
    bench.tell({});
    const Told read = bench.run("position");
    ASSERT_EQ(read.error, Error::none) << read.detail;
    EXPECT_EQ(read.reading->singleturn_bits, real.resolution);
    EXPECT_EQ(read.reading->singleturn, bench.encoder.measure(bench.line.now()).singleturn);
    EXPECT_EQ(read.reading->multiturn_bits, static_cast<unsigned>(real.multiturn_bits));
  }
}

TEST_P(EncolinkHost, TheIdentityContradictsTheOptions) {
  Bench bench(testing::multi, wire);
  bench.tell({.resolution = 0, .multiturn_bits = 0});
  const Told read = bench.run("position");
  EXPECT_EQ(read.error, Error::unexpected_reply);
  EXPECT_NE(read.detail.find("multiturn_bits"), std::string::npos);
}

TEST_P(EncolinkHost, Identifies) {
  Bench bench(testing::single, wire);
  bench.tell({});
  const Told identify = bench.run("identify");
  ASSERT_EQ(identify.error, Error::none);
  EXPECT_EQ(identify.numbers.at("resolution"), 20);
  EXPECT_EQ(identify.numbers.at("frame_bytes"), 5);
  EXPECT_EQ(identify.numbers.at("protocol_version"), 2);
  EXPECT_EQ(identify.texts.at("part_number"), "MB080SLA20MENT00");
}

TEST(EncolinkHostUart, AnEncoderThatDoesNotIdentifyItself) {
  Bench bench(testing::multi);
  bench.restart(PowerOn::real);  // it is not heard while it starts
  bench.tell({});
  const Told read = bench.run("position");
  EXPECT_EQ(read.error, Error::wrong_length);
  EXPECT_NE(read.detail.find("did not identify itself"), std::string::npos);
}

TEST_P(EncolinkHost, AWrongResolutionIsSeen) {
  Bench bench(testing::single, wire);
  bench.format.resolution = 19;  // 0x12345 is odd
  const Told read = bench.run("position");
  EXPECT_EQ(read.error, Error::out_of_range);
  EXPECT_NE(read.detail.find("resolution"), std::string::npos);
  EXPECT_FALSE(read.reading);
}

TEST(EncolinkHostUart, AReplyThatEndsEarly) {
  Bench bench;
  bench.device.set([](unsigned, std::vector<std::uint8_t>& reply) { reply.resize(4); });
  const Told read = bench.run("position");
  EXPECT_EQ(read.error, Error::wrong_length);
  EXPECT_EQ(read.detail, "the reply ended early");
}

TEST(EncolinkHostUart, AFrameWithTurnsWhereNoneAreExpected) {
  Bench bench(testing::multi);
  bench.tell(testing::single);
  const Told read = bench.run("position");
  EXPECT_NE(read.error, Error::none);
}

TEST(EncolinkHostUart, NothingComes) {
  Bench bench;
  bench.encoder.power_off(bench.line.now());
  const Told read = bench.run("position");
  EXPECT_EQ(read.error, Error::timeout);
  EXPECT_EQ(bench.took, 20us + answer_limit);
}

TEST(EncolinkHostSpi, AWireThatIsStuckIsNamed) {
  Bench off(testing::single, Wire::spi);
  off.encoder.power_off(off.line.now());
  const Told high = off.run("position");
  EXPECT_EQ(high.error, Error::line_stuck);
  EXPECT_EQ(high.detail, "MISO stayed high");

  Bench bench(testing::single, Wire::spi);
  bench.device.set([](unsigned, std::vector<std::uint8_t>& reply) { reply.assign(5, 0); });
  const Told low = bench.run("position");
  EXPECT_EQ(low.error, Error::line_stuck);
  EXPECT_EQ(low.detail, "MISO stayed low");
}

TEST_P(EncolinkHost, ReadsFramesWithoutChannel2) {
  const Format old{20, 0, false};
  Bench bench(old, wire);
  const Told read = bench.run("position");
  ASSERT_EQ(read.error, Error::none);
  EXPECT_EQ(read.reading->singleturn, 0x12345u);
  EXPECT_EQ(bench.run("alarms").error, Error::unsupported);
  EXPECT_EQ(bench.run("memory-read", {0x4C}).error, Error::unsupported);
}

// ---- Channel 2

TEST_P(EncolinkHost, TheDetailedStatusTakesOneCycle) {
  for (const Format& format : {testing::single, testing::multi}) {
    Bench bench(format, wire);
    bench.shaft.spin(3000, bench.line.now());  // each frame another position: the first of the cycle counts
    bench.encoder.raise_alarms(status::temperature | status::multiturn_mismatch);
    const Told read = bench.run("alarms");
    ASSERT_EQ(read.error, Error::none) << read.detail;
    EXPECT_EQ(read.numbers.at("status"), status::temperature | status::multiturn_mismatch);
    EXPECT_EQ(bench.frames, 1 + format.cycle_bytes());
    EXPECT_EQ(read.reading->alarms, std::uint32_t{status::temperature | status::multiturn_mismatch});
    EXPECT_FALSE(read.reading->multiturn_valid);
    EXPECT_EQ(read.numbers.at("alarms"), status::temperature | status::multiturn_mismatch);
  }
}

TEST_P(EncolinkHost, AnAlarmBitIsFollowedByItsWords) {
  Bench bench(testing::single, wire);
  bench.encoder.raise_alarms(status::temperature);
  const Told warning = bench.run("position");
  ASSERT_EQ(warning.error, Error::none);
  EXPECT_EQ(warning.reading->status, general::warning);
  EXPECT_EQ(warning.reading->alarms, std::uint32_t{status::temperature});
  EXPECT_TRUE(warning.reading->singleturn_valid());
  bench.encoder.raise_alarms(status::signal_lost);
  const Told error = bench.run("position");
  EXPECT_EQ(error.reading->alarms, std::uint32_t{status::temperature | status::signal_lost});
  EXPECT_FALSE(error.reading->singleturn_valid());
}

TEST_P(EncolinkHost, Channel2ThatDisagreesIsAnErrorOfItsOwn) {
  Bench bench(testing::multi, wire);
  bench.condition(condition_channels_disagree, 1);
  const Told status = bench.run("alarms");
  EXPECT_EQ(status.error, Error::cross_check_failed);
  EXPECT_NE(status.detail.find("channel 2 has another position"), std::string::npos);
  EXPECT_EQ(bench.run("position").error, Error::none);  // positions go on
  const Told read = bench.run("memory-read", {0x4C});
  EXPECT_EQ(read.error, Error::cross_check_failed);
  EXPECT_GT(bench.emits, 20u);
}

TEST_P(EncolinkHost, ADamagedCycleIsReadAgain) {
  Bench bench(testing::single, wire);
  bench.device.set([](unsigned frame, std::vector<std::uint8_t>& reply) {
    if (frame == 4) reply[4] ^= 0x01;
  });
  const Told read = bench.run("alarms");
  EXPECT_EQ(read.error, Error::none);
  EXPECT_EQ(bench.frames, 2 * (1 + 7u));
  bench.device.set([](unsigned, std::vector<std::uint8_t>& reply) { reply[4] ^= 0x01; });
  EXPECT_EQ(bench.run("alarms").error, Error::bad_checksum);
}

TEST_P(EncolinkHost, ALostFrameBeginsTheCycleAnew) {
  Bench bench(testing::multi, wire);
  bench.device.set([](unsigned frame, std::vector<std::uint8_t>& reply) {
    if (frame == 3) reply[0] ^= 0x01;
  });
  const Told read = bench.run("alarms");
  EXPECT_EQ(read.error, Error::none);
  EXPECT_EQ(bench.frames, 3 + 1 + 1 + 9u);
}

// ---- Power on

TEST_P(EncolinkHost, ZerosWithoutChannel2AreNotReady) {
  Bench bench(testing::single, wire);
  bench.restart(PowerOn::real);
  bench.line.wake(0);
  const Told early = bench.run("position");
  ASSERT_EQ(early.error, Error::none);  // well formed
  EXPECT_FALSE(early.reading->ready);
  bench.pass(start_up);
  const Told late = bench.run("position");
  EXPECT_TRUE(late.reading->ready);
  EXPECT_EQ(late.reading->singleturn, 0x12345u);
}

TEST_P(EncolinkHost, ARealZeroIsReady) {
  Bench bench(testing::single, wire);
  bench.shaft.put(0, 0);
  const Told read = bench.run("position");
  ASSERT_EQ(read.error, Error::none);
  EXPECT_EQ(read.reading->singleturn, 0u);
  EXPECT_TRUE(read.reading->ready);
}

// ---- Listening

Format streaming(Format format, std::uint32_t rate) {
  format.stream_rate = rate;
  return format;
}

TEST(EncolinkListen, FindsTheFramesByTheirChecksums) {
  Bench bench(streaming(testing::multi, 5000));
  bench.shaft.spin(60, bench.line.now());
  bench.pass(1ms + 95us);  // into the middle of a frame
  Listen listen(bench.format, 50);
  std::vector<std::uint64_t> seen;
  bench.drive(listen, [&] { seen.push_back(listen.reading()->singleturn); });
  ASSERT_EQ(listen.error(), Error::none) << listen.detail();
  ASSERT_EQ(seen.size(), 49u);
  EXPECT_LT(listen.skipped(), 7u);
  for (std::size_t i = 1; i < seen.size(); ++i) EXPECT_GT(seen[i], seen[i - 1]);
  EXPECT_NE(listen.reading(), nullptr);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(EncolinkListen, FindsTheNextFrameAfterADamagedOne) {
  Bench bench(streaming(testing::single, 1000));
  bench.device.set([](unsigned frame, std::vector<std::uint8_t>& reply) {
    if (frame == 10) reply.erase(reply.begin());
    if (frame == 20) reply[1] ^= 0x40;
    if (frame == 30) reply.insert(reply.begin(), 0x55);
  });
  bench.line.wake(0);
  Listen listen(bench.format, 40);
  bench.drive(listen);
  EXPECT_EQ(listen.error(), Error::none);
  EXPECT_EQ(listen.reading()->singleturn, 0x12345u);
  EXPECT_GT(listen.skipped(), 8u);
  EXPECT_LT(bench.took, 50ms);
}

TEST(EncolinkListen, OneGoodChecksumMayBeAccident) {
  const auto feed = [](Listen& listen, Bytes bytes) {
    listen.next(Time{});
    listen.feed({.kind = Event<std::uint8_t>::Kind::received, .at = 1ms, .items = bytes});
  };
  const ReplyBytes accident = encode_position(testing::single, {.singleturn = 999});
  const ReplyBytes real = encode_position(testing::single, {.singleturn = 0x12345});
  Listen listen(testing::single, 1);
  feed(listen, accident);
  EXPECT_EQ(listen.reading(), nullptr);
  feed(listen, hex<"5566">);
  feed(listen, real);
  EXPECT_EQ(listen.reading(), nullptr);
  feed(listen, real);
  ASSERT_NE(listen.reading(), nullptr);
  EXPECT_EQ(listen.reading()->singleturn, 0x12345u);
  EXPECT_EQ(listen.skipped(), 7u);
  EXPECT_EQ(listen.next(1ms).kind, Step<std::uint8_t>::Kind::done);
}

TEST(EncolinkListen, SaysWhatItHears) {
  Bench silent;
  Listen nothing(silent.format, 1);
  silent.drive(nothing);
  EXPECT_EQ(nothing.error(), Error::timeout);
  EXPECT_EQ(silent.took, listen_limit);

  Bench other(streaming(testing::multi, 1000));
  Listen single(testing::single, 1);
  other.drive(single);
  EXPECT_NE(single.error(), Error::none);
  EXPECT_NE(single.detail().find("no two frames"), std::string_view::npos);

  Bench fine(streaming(testing::single, 1000));
  Listen coarse({.resolution = 18, .multiturn_bits = 0}, 1);
  fine.drive(coarse);
  EXPECT_EQ(coarse.error(), Error::out_of_range);

  Listen unknown(Format{});
  EXPECT_EQ(unknown.error(), Error::invalid_argument);
}

}  // namespace
}  // namespace absenc::encolink
