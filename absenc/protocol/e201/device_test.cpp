// SPDX-License-Identifier: Apache-2.0
// The virtual E201-9S, asked by hand.
#include "absenc/protocol/e201/device.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/e201/bench_test.hpp"

namespace absenc::e201 {
namespace {

using testing::Bench;

TEST(E201Device, AnswersLikeExample4) {
  // 13 bits of ACK at 280 kHz (3571 ns): more than 12 periods of latency, less than the timeout allows.
  Bench bench(testing::biss_format({.position = 19}), {.behaviour = {.latency = 46us}});
  bench.shaft.state.position = std::int64_t{275087} << 13;
  EXPECT_EQ(bench.raw("4"), "c0014328ff300000\r");
}

TEST(E201Device, AnswersEveryCommand) {
  Bench bench;
  bench.shaft.state.position = (std::int64_t{2} << 32) + (std::int64_t{5} << 13);
  EXPECT_EQ(bench.raw("v"), "E201-9S V1.16\r");
  EXPECT_EQ(bench.raw("s"), "09S0417\r");
  EXPECT_EQ(bench.raw("e"), "4.98V 62mA\r");
  EXPECT_EQ(bench.raw("m"), "4\r");
  EXPECT_EQ(bench.raw("M8\r"), "");
  EXPECT_EQ(bench.raw("m"), "8\r");
  EXPECT_EQ(bench.raw("M9"), "");  // no such clock
  EXPECT_EQ(bench.raw("m"), "8\r");
  EXPECT_EQ(bench.raw("b"), "35\r");
  EXPECT_EQ(bench.raw("?"), "1048581\r");
  EXPECT_EQ(bench.raw(">"), "100005\r");
  EXPECT_EQ(bench.raw("B19\r"), "");
  EXPECT_EQ(bench.raw("?"), "5\r");
  EXPECT_EQ(bench.raw("z"), "");
  bench.shaft.state.position -= std::int64_t{1} << 13;
  EXPECT_EQ(bench.raw("?"), "-1\r");
  EXPECT_EQ(bench.raw(">"), "7ffff\r");
  EXPECT_EQ(bench.raw("a"), "");
  EXPECT_EQ(bench.raw("?"), "4\r");
  EXPECT_EQ(bench.raw("f"), "");
  EXPECT_EQ(bench.raw("e"), "0.02V 0mA\r");
  EXPECT_EQ(bench.raw("4"), "0000000000000000\r");
  EXPECT_EQ(bench.raw("n"), "");
  EXPECT_EQ(bench.raw("4").substr(0, 1), "c");
  EXPECT_EQ(bench.adapter.violation_count(), 0u);
  EXPECT_EQ(bench.raw("x"), "");
  EXPECT_EQ(bench.raw("MM"), "");
  EXPECT_EQ(bench.adapter.violation_count(), 2u);
}

TEST(E201Device, SeveralCommandsAreAnsweredOneAfterTheOther) {
  Bench bench;
  EXPECT_EQ(bench.raw("mvM5\rm"), "4\rE201-9S V1.16\r5\r");
}

TEST(E201Device, StreamsPositions) {
  Bench bench;
  testing::RawHost host("1", Time{});
  bench.line.attach(sim::Role::host, host);
  bench.line.run_until(45ms);
  EXPECT_EQ(host.reply, "0\r");  // that host leaves at the first pause
  EXPECT_GE(bench.adapter.answered(), 1u);
  std::string heard;
  bench.line.observe([&heard](auto, Time, Time, std::uint8_t byte) { heard += static_cast<char>(byte); });
  bench.line.run_until(95ms);
  EXPECT_EQ(heard, "0\r0\r0\r0\r0\r");
  bench.raw("0");
  heard.clear();
  bench.line.run_until(bench.line.now() + 100ms);
  EXPECT_EQ(heard, "");
}

TEST(E201Device, OldFirmwareKnowsNo4) {
  Bench bench(testing::biss_format(), {.firmware = {1, 9}});
  EXPECT_EQ(bench.raw("4"), "");
  EXPECT_EQ(bench.raw("v"), "E201-9S V1.09\r");
}

TEST(E201Device, AckFollowsTheClock) {
  Bench bench(testing::biss_format({.position = 19}));
  for (unsigned clock = 1; clock <= 7; ++clock) {
    bench.raw("M" + std::to_string(clock));
    const std::string reply = bench.raw("4");
    const Result<Position> position =
        decode_position(bench.format, {reinterpret_cast<const std::uint8_t*>(reply.data()), reply.size()});
    ASSERT_TRUE(position) << clock;
    EXPECT_EQ(position->ack_bits, biss::ack_bits(10us, clock_period(clock)));
  }
}

}  // namespace
}  // namespace absenc::e201
