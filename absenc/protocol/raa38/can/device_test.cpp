// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/can/device.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/raa38/can/bench_test.hpp"

namespace absenc::raa38::can {
namespace {

using testing::Bench;
using testing::RawHost;
using testing::silent;
using testing::Talk;
using Frames = std::vector<CanFrame>;
using PowerOn = Device<CanFrame>::PowerOn;

TEST(CanDevice, SendsUnaskedAfterPowerOn) {
  Bench bench;
  bench.shaft.put(0, 0x0B02);
  RawHost host(CanFrame{.id = 0x7FF}, 1050ms);
  EXPECT_EQ(bench.run(host).heard, Frames(10, encode_position(0x20, 0x0B02)));
}

TEST(CanDevice, AnswersAsTheDocumentShows) {
  Bench bench({.cyclic = 0});
  bench.shaft.put(0, 0x2647);
  const auto frame = [](std::uint32_t id, std::initializer_list<std::uint8_t> bytes) {
    CanFrame made{.id = id, .size = 8};
    std::copy(bytes.begin(), bytes.end(), made.data.begin());
    return made;
  };
  EXPECT_EQ(bench.raw(frame(0x220, {0x80, 0x20})), Frames{frame(0x120, {0x47, 0x26})});
  EXPECT_EQ(bench.raw(frame(0x220, {0x01, 0x20})), Frames{frame(0x120, {0x47, 0x26})});
  EXPECT_EQ(bench.raw(frame(0x7E5, {0x04, 0x01})), Frames{});
  EXPECT_EQ(bench.raw(frame(0x7E5, {0x11, 0x21})), Frames{frame(0x7E5, {0x11, 0x00})});
  EXPECT_EQ(bench.raw(frame(0x220, {0x80, 0x20})), Frames{});
  EXPECT_EQ(bench.raw(frame(0x221, {0x22, 0x21, 0x01})), Frames{frame(0x121, {0x22, 0x00})});
  EXPECT_EQ(bench.raw(frame(0x221, {0x20, 0x21})), Frames{frame(0x121, {0x20, 0x00})});
  EXPECT_EQ(bench.raw(frame(0x221, {0x80, 0x21})), Frames{frame(0x121, {})});
  EXPECT_EQ(bench.raw(frame(0x221, {0x31, 0x21, 0x00})), Frames{frame(0x121, {0x31, 0x00})});
  EXPECT_EQ(bench.node().violation_count(), 0u);
  EXPECT_EQ(bench.node().wear(), 3u);
}

TEST(CanDevice, SettingsSurvivePowerOff) {
  Bench bench({.cyclic = 0});
  bench.shaft.put(0, 500);
  bench.raw(encode_configuration(configuration::enter, 1));
  bench.raw(encode_configuration(configuration::node, 0x42));
  bench.raw(encode_command(0x42, command::direction, 1));
  bench.raw(encode_command(0x42, command::zero));
  bench.raw(encode_configuration(configuration::rate, 0, 2));
  const Bytes memory = bench.node().memory();
  testing::TestShaft shaft;
  shaft.put(0, 510);
  VirtualNode again(silent, shaft);
  std::copy(memory.begin(), memory.end(), again.memory().begin());
  again.power_on(Time{}, PowerOn::skip);
  EXPECT_EQ(again.node(), 0x42);
  EXPECT_EQ(again.rate(), 500'000u);
  EXPECT_EQ(again.position(Time{}), (1u << 14) - 10);
  EXPECT_EQ(again.wear(), 4u);
  const Step<CanFrame> step = again.next(Time{});
  EXPECT_EQ(step.kind, Step<CanFrame>::Kind::configure);
  EXPECT_EQ(step.settings.rate, 500'000u);
}

TEST(CanDevice, MemoryOfAnother) {
  testing::TestShaft shaft;
  VirtualNode node(silent, shaft);
  std::fill(node.memory().begin(), node.memory().end(), std::uint8_t{0});
  node.memory()[1] = 9;
  node.power_on(Time{}, PowerOn::skip);
  EXPECT_EQ(node.node(), 0x20);
  EXPECT_EQ(node.rate(), 250'000u);
}

TEST(CanDevice, NamesTheRulesThatAreBroken) {
  CanFrame seven = encode_command(0x20, command::read);
  seven.size = 7;
  CanFrame remote = encode_command(0x20, command::read);
  remote.remote = true;
  CanFrame other_node = encode_command(0x20, command::read);
  other_node.data[1] = 0x21;
  const std::pair<CanFrame, std::string_view> cases[] = {
      {seven, "8 bytes"},
      {remote, "8 bytes"},
      {other_node, "second byte"},
      {encode_command(0x20, 0x7F), "unknown command"},
      {encode_command(0x20, command::direction, 9), "counting direction"},
      {encode_command(0x20, command::direction, 0), "set already"},
      {encode_configuration(configuration::node, 0x33), "configuration mode"},
  };
  for (const auto& [frame, words] : cases) {
    Bench bench({.cyclic = 0});
    bench.raw(frame);
    ASSERT_EQ(bench.node().violation_count(), 1u) << words;
    EXPECT_NE(bench.node().violations()[0].rule.find(words), std::string_view::npos) << words;
  }
  const std::pair<CanFrame, std::string_view> configured[] = {
      {encode_configuration(configuration::rate, 0, 1), "bit rate"},
      {encode_configuration(configuration::node, 0), "node number"},
      {encode_configuration(0x77, 1), "configuration command"},
      {encode_configuration(configuration::node, 0x20), "set already"},
  };
  for (const auto& [frame, words] : configured) {
    Bench bench({.cyclic = 0});
    bench.raw(encode_configuration(configuration::enter, 1));
    bench.raw(frame);
    ASSERT_EQ(bench.node().violation_count(), 1u) << words;
    EXPECT_NE(bench.node().violations()[0].rule.find(words), std::string_view::npos) << words;
  }
}

TEST(CanDevice, ASettingWhileItSendsIsARuleBroken) {
  Bench bench;
  bench.shaft.put(0, 5);
  bench.raw(encode_command(0x20, command::zero));
  ASSERT_EQ(bench.node().violation_count(), 1u);
  EXPECT_NE(bench.node().violations()[0].rule.find("by itself"), std::string_view::npos);
}

TEST(CanDevice, IsDeadWithoutPower) {
  Bench bench;
  bench.node().power_off(bench.line.now());
  EXPECT_EQ(bench.raw(encode_command(0x20, command::read)), Frames{});
}

// A shaft at any place, any resolution: the position is what the frames say.
TEST(CanDevice, EveryResolution) {
  for (unsigned bits = 10; bits <= 21; ++bits) {
    Bench bench({.bits = bits, .cyclic = 0});
    bench.shaft.start.position = 0x5A5A5A5A;
    EXPECT_EQ(bench.read(), 0x5A5A5A5Au >> (32 - bits));
  }
}

}  // namespace
}  // namespace absenc::raa38::can
