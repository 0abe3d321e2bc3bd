// SPDX-License-Identifier: Apache-2.0
// Tests of the virtual E201-9S with raw commands.
#include <gtest/gtest.h>

#include "absenc/protocol/biss/frame.hpp"
#include "absenc/protocol/e201/bench_test.hpp"

namespace absenc::e201 {
namespace {

using testing::Bench;
using testing::count;
using testing::turn;

TEST(E201Device, RepliesWithExample4) {
  // At 280 kHz (period 3571 ns) a latency of 46 us gives 13 bits of ACK.
  Bench bench("singleturn_bits=19 latency_us=46");
  bench.shaft.start.position = 275087 * count;
  EXPECT_EQ(bench.raw("4"), "c0014328ff300000\r");
}

TEST(E201Device, RepliesToEveryCommand) {
  Bench bench;
  bench.shaft.start.position = 2 * turn + 5 * count;
  const auto expect = [&bench](const std::string& request, const std::string& reply) {
    EXPECT_EQ(bench.raw(request), reply) << request;
  };
  expect("v", "E201-9S V1.16\r");
  expect("s", "09S0417\r");
  expect("e", "4.98V 62mA\r");
  expect("m", "4\r");
  expect("M8\r", "");
  expect("m", "8\r");
  expect("b", "35\r");
  expect("?", "1048581\r");
  expect(">", "000100005\r");
  expect("1", "1048581\r");  // reply to `1`: the first position of a stream
  expect("B20\r", "");
  expect("b", "20\r");
  expect(">", "00005\r");
  expect("B35\r", "");
  expect("z", "");
  bench.shaft.start.position -= count;
  expect("?", "-1\r");
  bench.device.power_off(bench.line.now());
  expect("?", "");
  bench.device.power_on(bench.line.now(), Device<std::uint8_t>::PowerOn::real);
  expect("?", "1048580\r");  // the zero is lost when the interface is powered off
  expect("za?", "1048580\r");
  expect("0", "");
  expect("f", "");
  expect("e", "0.02V 0mA\r");
  expect("4", "0000000000000000\r");
  expect("?", "0\r");
  expect("n", "");
  EXPECT_EQ(bench.raw("4").substr(0, 1), "c");
  EXPECT_EQ(bench.device.violation_count(), 0u);
  EXPECT_EQ(bench.device.answer_count(), 27u);
  EXPECT_TRUE(bench.device.memory().empty());
}

TEST(E201Device, ReportsUnknownCommands) {
  Bench bench;
  for (const char* text : {"x", "MM", "\r\n", "M9\r"}) EXPECT_EQ(bench.raw(text), "");
  ASSERT_EQ(bench.device.violation_count(), 3u);
  EXPECT_EQ(bench.device.violations()[2].rule, "an unknown command");
  EXPECT_EQ(bench.device.violations()[0].rule, "an unknown command");
  EXPECT_EQ(bench.device.violations()[1].rule, "a command without its number");
}

TEST(E201Device, RepliesToSeveralCommandsInOrder) {
  Bench bench;
  EXPECT_EQ(bench.raw("mvM5\rm"), "4\rE201-9S V1.16\r5\r");
}

TEST(E201Device, OldFirmwareIgnoresCommand4) {
  Bench bench("firmware=1.09");
  EXPECT_EQ(bench.raw("4"), "");
  EXPECT_EQ(bench.raw("v"), "E201-9S V1.09\r");
}

TEST(E201Device, AckBitsFollowClock) {
  Bench bench("singleturn_bits=19");
  for (unsigned clock = 1; clock <= 7; ++clock) {
    bench.raw("M" + std::to_string(clock));
    EXPECT_EQ(bench.run("position").fields["ack_bits"], biss::ack_bits(10us, clock_period(clock))) << clock;
  }
}

// Checks that the command that reads a position takes longer than another command by 64 clock periods, and by the time
// of the longer reply.
TEST(E201Device, ReadingTakes64Clocks) {
  Bench bench;
  bench.raw("M1");
  const Time slow = bench.run("position").took;
  bench.raw("M4");
  EXPECT_EQ(slow - bench.run("position").took, 64 * (clock_period(1) - clock_period(4)));
  // The reply to the command `clock` is 15 characters shorter than the reply to `position`.
  const Time characters = slow - bench.run("clock").took - 64 * clock_period(1);
  EXPECT_LT(std::chrono::abs(characters - line_settings.bits(150)), 1us);
}

TEST(E201Device, LineDelayCausesBadFraming) {
  Bench bench("singleturn_bits=19 line_delay_ns=3600");
  EXPECT_EQ(bench.run("position").error, "bad_framing");
  bench.raw("M3");
  EXPECT_EQ(bench.run("position").error, "none");
}

}  // namespace
}  // namespace absenc::e201
