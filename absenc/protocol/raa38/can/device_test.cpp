// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/can/bench_test.hpp"

namespace absenc::raa38::can {
namespace {

using namespace testing;

CanFrame frame(std::uint32_t id, std::initializer_list<std::uint8_t> bytes) {
  CanFrame made{.id = id, .size = 8};
  std::copy(bytes.begin(), bytes.end(), made.data.begin());
  return made;
}

TEST(Raa38CanDevice, SendsPositionsAfterPowerOn) {
  Bench bench;
  EXPECT_EQ(bench.count(1050ms), 10u);
  bench.encoder().power_off(bench.line.now());
  EXPECT_EQ(bench.raw(encode(Order::read, 0x20)), Frames{});
}

TEST(Raa38CanDevice, AnswersExamplesOfTheDocument) {
  Bench bench(quiet);
  bench.put(0x2647);
  EXPECT_EQ(bench.raw(frame(0x220, {0x80, 0x20})), Frames{frame(0x120, {0x47, 0x26})});
  EXPECT_EQ(bench.raw(frame(0x220, {0x01, 0x20})), Frames{frame(0x120, {0x47, 0x26})});
  EXPECT_EQ(bench.raw(frame(0x7E5, {0x04, 0x01})), Frames{});
  EXPECT_EQ(bench.raw(frame(0x7E5, {0x11, 0x21})), Frames{frame(0x7E5, {0x11, 0x00})});
  EXPECT_EQ(bench.raw(frame(0x220, {0x80, 0x20})), Frames{});
  EXPECT_EQ(bench.raw(frame(0x221, {0x22, 0x21, 0x01})), Frames{frame(0x121, {0x22, 0x00})});
  EXPECT_EQ(bench.raw(frame(0x221, {0x20, 0x21})), Frames{frame(0x121, {0x20, 0x00})});
  EXPECT_EQ(bench.raw(frame(0x221, {0x80, 0x21})), Frames{frame(0x121, {})});
  EXPECT_EQ(bench.raw(frame(0x221, {0x31, 0x21, 0x00})), Frames{frame(0x121, {0x31, 0x00})});
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
  EXPECT_EQ(bench.encoder().settings().writes(), 3u);
}

TEST(Raa38CanDevice, SettingsSurvivePowerOff) {
  Bench bench(quiet);
  bench.put(500);
  for (const CanFrame& setting :
       {encode(Order::enter, 0, 1), encode(Order::node, 0, 0x42), encode(Order::direction, 0x42, 1),
        encode(Order::zero, 0x42), encode(Order::rate, 0, 2)}) {
    bench.raw(setting);
  }
  bench.put(510);
  VirtualNode again(quiet, bench.shaft);
  std::copy(bench.encoder().memory().begin(), bench.encoder().memory().end(), again.memory().begin());
  again.power_on(Time{}, Device<CanFrame>::PowerOn::skip);
  EXPECT_EQ(again.node(), 0x42);
  EXPECT_EQ(again.settings().position(Time{}), (1u << 14) - 10);
  EXPECT_EQ(again.settings().writes(), 4u);
  const Step<CanFrame> step = again.next(Time{});
  EXPECT_EQ(step.kind, Step<CanFrame>::Kind::configure);
  EXPECT_EQ(step.rate, 500'000u);
  // At power on the node replaces an invalid node number and bit rate.
  std::fill(again.memory().begin(), again.memory().end(), std::uint8_t{0});
  again.memory()[1] = 9;
  again.power_on(Time{}, Device<CanFrame>::PowerOn::skip);
  EXPECT_EQ(again.node(), 0x20);
  EXPECT_EQ(again.rate(), 250'000u);
}

TEST(Raa38CanDevice, ReportsEachBrokenRule) {
  CanFrame seven = encode(Order::read, 0x20);
  seven.size = 7;
  CanFrame remote = encode(Order::read, 0x20);
  remote.remote = true;
  struct Row {
    CanFrame sent;
    std::string_view words;
    bool configuring = false;
    std::uint8_t cyclic = 0;
  };
  const Row rows[]{
      {seven, "8 bytes"},
      {remote, "8 bytes"},
      {frame(0x220, {0x80, 0x21}), "second byte"},
      {frame(0x220, {0x7F, 0x20}), "unknown command"},
      {encode(Order::direction, 0x20, 9), "counting direction"},
      {encode(Order::direction, 0x20, 0), "set already"},
      {encode(Order::node, 0, 0x33), "configuration mode"},
      {frame(0x7E5, {0x77, 1}), "configuration mode"},
      {encode(Order::rate, 0, 1), "bit rate", true},
      {frame(0x7E5, {0x13, 1, 2}), "bit rate", true},
      {encode(Order::node, 0, 0), "node number", true},
      {frame(0x7E5, {0x77, 1}), "configuration command", true},
      {encode(Order::node, 0, 0x20), "set already", true},
      {encode(Order::zero, 0x20), "by itself", false, 10},
  };
  for (const Row& row : rows) {
    Bench bench({.cyclic = row.cyclic});
    bench.put(5);
    if (row.configuring) bench.raw(encode(Order::enter, 0, 1));
    bench.raw(row.sent);
    ASSERT_EQ(bench.encoder().violation_count(), 1u) << row.words;
    EXPECT_TRUE(says(bench.encoder().violations()[0].rule, row.words)) << row.words;
  }
}

}  // namespace
}  // namespace absenc::raa38::can
