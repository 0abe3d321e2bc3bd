// SPDX-License-Identifier: Apache-2.0
// Tests of the virtual encoder and its line by their samples, without the host code.
#include "absenc/protocol/biss/device.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/biss/bench_test.hpp"

namespace absenc::biss {
namespace {

using testing::Bench;

const Format bits_19{};

// clang 14 leaves some members uninitialised with Format{.ready = ready}.
Format format_with(Time latency, Time ready, Time line_delay = {}) {
  Format format = bits_19;
  format.latency = latency;
  format.ready = ready;
  format.line_delay_ns = static_cast<std::uint32_t>(line_delay.count());
  return format;
}

TEST(BissDevice, SendsExample4) {
  Bench bench(line_settings, bits_19, Behaviour{.latency = 13us});
  bench.shaft.state.position = std::int64_t{275087} << 13;
  EXPECT_EQ(bench.clock(44, 1ms, 1'000'000), "11000000000000010100001100101000111111110011");
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
  EXPECT_EQ(bench.encoder.answer_count(), 1u);
}

TEST(BissDevice, HoldsSloLowAfterCrc) {
  Bench bench(line_settings, format_with(Format{}.latency, 2us, 2300ns));
  bench.shaft.state.position = std::int64_t{275087} << 13;
  const std::string samples = bench.clock(200, 1ms, 1'000'000);
  EXPECT_EQ(samples.substr(0, 35), "11110010100001100101000111111110011");
  EXPECT_EQ(samples.find('1', 35), std::string::npos);
  // A frame that is clocked within the BiSS timeout is low from its first sample on.
  EXPECT_EQ(bench.clock(200, 10us, 1'000'000), std::string(200, '0'));
}

TEST(BissDevice, ReportsBrokenTimingRules) {
  Bench bench(line_settings, bits_19);
  bench.clock(41, 1ms, 1'000'000);
  EXPECT_EQ(bench.last_rule(), "");
  bench.clock(40, 1ms, 1'000'000);
  EXPECT_EQ(bench.last_rule(), "fewer clocks than the frame has bits");
  bench.clock(200, 1ms, 12'500'000);
  EXPECT_EQ(bench.last_rule(), "MA faster than 10 MHz");
  EXPECT_EQ(bench.clock(64, 1ms, 20'000), std::string(64, '1'));
  EXPECT_EQ(bench.encoder.violations()[2].rule, "MA slower than the BiSS timeout allows");

  Bench soon(line_settings, bits_19);
  soon.clock(64, 1ms, 1'000'000);
  EXPECT_EQ(soon.clock(16, 19us, 1'000'000), "0000000000000000");
  EXPECT_EQ(soon.last_rule(), "clocked before the BiSS timeout has passed");
  EXPECT_EQ(soon.encoder.answer_count(), 1u);
  EXPECT_EQ(soon.clock(16, 20us, 1'000'000), "1100000000001000");
  // The host broke two rules: it clocked before the timeout had passed, and then read a frame with only 16 clocks.
  EXPECT_EQ(soon.encoder.violation_count(), 2u);
}

TEST(BissDevice, UsesTimeoutOfFormat) {
  // `pause` begins at the end of the last clock period of the first frame, half a period after its last rising edge.
  const auto allows = [](Timeout timeout, std::uint32_t rate, Time pause) {
    Format format = bits_19;
    format.timeout = timeout;
    Bench bench(line_settings, format);
    bench.clock(64, 1ms, rate);
    bench.clock(64, pause, rate);
    return bench.last_rule() != "clocked before the BiSS timeout has passed";
  };
  EXPECT_FALSE(allows({}, 1'000'000, 19'400ns));
  EXPECT_TRUE(allows({}, 1'000'000, 19'500ns));
  for (const Time fixed : {12'500ns, 20'000ns, 40'000ns}) {
    EXPECT_FALSE(allows(Timeout::fixed(fixed), 1'000'000, fixed - 600ns)) << fixed.count();
    EXPECT_TRUE(allows(Timeout::fixed(fixed), 1'000'000, fixed - 500ns)) << fixed.count();
  }
  EXPECT_FALSE(allows(Timeout::adaptive(), 1'000'000, 900ns));
  EXPECT_TRUE(allows(Timeout::adaptive(), 1'000'000, 1us));
  EXPECT_FALSE(allows(Timeout::adaptive(), 100'000, 9'900ns));
  EXPECT_TRUE(allows(Timeout::adaptive(), 100'000, 10us));
}

TEST(BissDevice, ReadyTimeIsThatOfOptionsOrAtMostTenMicroseconds) {
  const auto ack = [](Time latency, Time ready) {
    Bench bench(line_settings, format_with(latency, ready));
    return bench.clock(64, 1ms, 1'000'000).find("1", 2) - 2;
  };
  EXPECT_EQ(ack(50us, 0us), 10u);
  EXPECT_EQ(ack(4us, 0us), 4u);
  EXPECT_EQ(ack(4us, 7us), 7u);
}

/// Returns how many of 100 frames the host receives unchanged with this delay of the line and this period of MA.
unsigned good_frames(Time line_delay, Time period) {
  testing::TestShaft shaft;
  shaft.state.position = 0x1234'5678'9ABC;
  Encoder encoder(bits_19, shaft, {.latency = 2us, .line_delay = line_delay});
  encoder.set_power(true);
  unsigned good = 0;
  for (int i = 0; i < 100; ++i) {
    Samples samples;
    encoder.sample(Time{}, period, samples);
    const Result<Reply> reply = decode(bits_19, samples.view());
    const bool framed = samples.view().load(0, 3) == 0b110;
    if (framed && reply && reply->word == encoder.word(Time{})) ++good;
  }
  return good;
}

TEST(BissDevice, LineDelayCorruptsFramesAtHighClocks) {
  EXPECT_EQ(good_frames(300ns, 1us), 100u);
  EXPECT_EQ(good_frames(300ns, 330ns), 100u);
  // each sample is taken when the delayed line just changes, so it reads the old bit or the new bit
  EXPECT_LT(good_frames(300ns, 315ns), 20u);
  EXPECT_LT(good_frames(300ns, 290ns), 20u);
  // the line delays the bits by a whole clock, so SLO seems to go low one sample late
  EXPECT_EQ(good_frames(300ns, 227ns), 0u);
}

TEST(BissDevice, LineDelayOfAWholeBitAddsAnIdleSample) {
  Bench bench(line_settings, format_with(Format{}.latency, 2us, 1500ns));
  EXPECT_EQ(bench.clock(7, 1ms, 1'000'000), "1110010");
}

TEST(BissDevice, SendsNoStartBitWhenNeverReady) {
  Bench bench(line_settings, format_with(Format{}.latency, 1ms));
  EXPECT_EQ(bench.clock(512, 1ms, 1'000'000), "11" + std::string(510, '0'));
}

}  // namespace
}  // namespace absenc::biss
