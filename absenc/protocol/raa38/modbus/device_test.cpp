// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/modbus/bench_test.hpp"

namespace absenc::raa38::rtu {
namespace {

using namespace testing;

TEST(Raa38ModbusDevice, AnswersExamplesOfTheManual) {
  Bench bench;
  bench.put(383);
  EXPECT_EQ(bench.raw({0x01, 0x03, 0x00, 0x00, 0x00, 0x01, 0x84, 0x0A}), (Wire{1, 3, 2, 0x01, 0x7F, 0xF8, 0x34}));
  EXPECT_EQ(bench.body({0x01, 0x03, 0x00, 0x00, 0x00, 0x02}), (Wire{1, 3, 4, 0, 0, 0x01, 0x7F}));
  EXPECT_EQ(bench.raw({0xFF, 0xA0, 0x40, 0x38}), (Wire{0xFF, 0xA0, 0x01, 0xF8, 0x30}));
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
  const std::pair<Data, Wire> forms[]{{Data::three_bytes, {1, 3, 3, 0x1F, 0xAB, 0xCD}},
                                      {Data::three_as_four, {1, 3, 4, 0x1F, 0xAB, 0xCD}}};
  for (const auto& [data, reply] : forms) {
    Bench other({.bits = 21, .data = data});
    other.put(0x1FABCD);
    EXPECT_EQ(other.body({1, 3, 0, 0, 0, 2}), reply);
  }
}

TEST(Raa38ModbusDevice, RefusesWithExceptionsOfTheStandard) {
  Bench bench;
  const std::pair<Wire, Wire> rows[]{
      {{1, 4, 0, 0, 0, 1}, {1, 0x84, 1}},  // function 04, read input registers: the encoder does not have it
      {{1, 1, 0, 0, 0, 1}, {1, 0x81, 1}},  // function 01, read coils: the encoder does not have it
      {{1, 6, 0, 0, 0, 1}, {1, 0x86, 1}},  // function 06, write a register: the encoder does not have it
      {{1, 0x11}, {1, 0x91, 1}},           // function 11, report server id: the encoder does not have it
      {{1, 3, 0, 1, 0, 1}, {1, 0x83, 2}},  // request that does not begin at register 0
      {{1, 3, 0, 0, 0, 3}, {1, 0x83, 2}},  // request of three registers, but only two exist
      {{1, 3, 0xFF, 0xFF, 0, 1}, {1, 0x83, 2}},
      {{1, 3, 0, 0, 0, 0}, {1, 0x83, 3}},    // request of 0 registers
      {{1, 3, 0, 0, 0, 126}, {1, 0x83, 3}},  // request of more registers than a frame can carry
      {{1, 3, 0, 0}, {1, 0x83, 3}},          // truncated request
  };
  for (const auto& [request, reply] : rows) EXPECT_EQ(bench.body(request), reply);
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
  Bench wide({.bits = 17});
  wide.put(0x1FFFF);
  EXPECT_EQ(wide.body({1, 3, 0, 0, 0, 1}), (Wire{1, 0x83, 3})) << "a part of the position";
  EXPECT_EQ(wide.body({1, 3, 0, 0, 0, 2}), (Wire{1, 3, 4, 0, 1, 0xFF, 0xFF}));
}

TEST(Raa38ModbusDevice, IgnoresFramesOfOthers) {
  Bench bench;
  for (const Wire& request : {
           Wire{2, 3, 0, 0, 0, 1},
           Wire{0, 3, 0, 0, 0, 1},  // address 0: a broadcast, which no slave answers
           Wire{0xFF, 3, 0, 0, 0, 1},
           Wire{1, 0xA0},     // function A0 (read the address) is only answered at address FF
           Wire{1, 0x83, 2},  // a refusal, which only a slave sends
           Wire{1, 0xA1},
           Wire{1, 0xCC, 1, 1},
       }) {
    EXPECT_EQ(bench.body(request), Wire{});
  }
  EXPECT_EQ(bench.raw({0x01, 0x03, 0x00, 0x00, 0x00, 0x01, 0x0A, 0x84}), Wire{}) << "CRC the other way round";
  EXPECT_EQ(bench.encoder().answer_count(), 0u);
  EXPECT_EQ(bench.encoder().settings().writes() + bench.encoder().violation_count(), 0u);
}

TEST(Raa38ModbusDevice, SettingsSurvivePowerOff) {
  Bench bench;
  bench.put(1000);
  EXPECT_EQ(bench.body({1, 0xCC, 0x00}), (Wire{1, 0xCC, 0x00}));
  EXPECT_EQ(bench.body({1, 0xCC, 0x02}), (Wire{1, 0xCC, 0x02}));
  EXPECT_EQ(bench.body({1, 0xA1, 9}), (Wire{9, 0xA1}));
  bench.put(1010);
  const Wire ten_backwards{9, 3, 2, 0x3F, 0xF6};
  EXPECT_EQ(bench.body({9, 3, 0, 0, 0, 1}), ten_backwards);
  EXPECT_EQ(bench.encoder().settings().writes(), 3u);
  bench.encoder().power_off(bench.line.now());
  EXPECT_EQ(bench.body({9, 3, 0, 0, 0, 1}), Wire{});
  bench.encoder().power_on(bench.line.now(), PowerOn::real);
  EXPECT_EQ(bench.body({9, 3, 0, 0, 0, 1}), ten_backwards);
  EXPECT_EQ(bench.body({9, 0xCC, 0x01}), (Wire{9, 0xCC, 0x01}));
  EXPECT_EQ(bench.body({9, 3, 0, 0, 0, 1}), (Wire{9, 3, 2, 0, 10}));
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
}

TEST(Raa38ModbusDevice, UsesNewBaudRateAfterReply) {
  for (std::size_t i = 0; i < bauds.size(); ++i) {
    if (i == baud_at_shipping) continue;
    Bench bench;
    EXPECT_EQ(bench.body({1, 0xCC, baud_parameters[i]}), (Wire{1, 0xCC, baud_parameters[i]}));
    EXPECT_EQ(bench.encoder().baud(), bauds[i]);
    EXPECT_EQ(bench.body({1, 3, 0, 0, 0, 1}), Wire{}) << "it listens at " << bauds[i];
    EXPECT_EQ(bench.run_command("baud").fields, "baud=" + std::to_string(bauds[i]) + " ");
    bench.encoder().power_off(bench.line.now());
    bench.encoder().power_on(bench.line.now(), PowerOn::skip);
    EXPECT_EQ(bench.encoder().baud(), bauds[i]);
  }
}

TEST(Raa38ModbusDevice, ReportsEachBrokenRule) {
  Bench bench;
  bench.body({1, 0xCC, 0x02});
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
  bench.body({1, 0xCC, 0x02});
  ASSERT_EQ(bench.encoder().violation_count(), 1u);
  EXPECT_TRUE(says(bench.encoder().violations()[0].rule, "has already"));
  EXPECT_EQ(bench.encoder().settings().writes(), 2u);
  for (unsigned i = 0; i < 12; ++i) bench.body({1, 0xCC, static_cast<std::uint8_t>(1 + i % 2)});
  ASSERT_EQ(bench.encoder().violation_count(), 2u);
  EXPECT_TRUE(says(bench.encoder().violations()[1].rule, "again and again"));
  for (const Wire& request : {Wire{1, 0xA1, 0}, Wire{1, 0xA1, 248}, Wire{1, 0xCC, 0x33}}) {
    EXPECT_EQ(bench.body(request), Wire{}) << "what cannot be set";
  }
  EXPECT_EQ(bench.encoder().violation_count(), 5u);
  EXPECT_EQ(bench.encoder().settings().writes(), 14u);
}

TEST(Raa38ModbusDevice, ReplacesInvalidMemory) {
  Bench bench;
  for (std::uint8_t& byte : bench.encoder().memory()) byte = 0xFF;
  bench.encoder().power_on(bench.line.now(), PowerOn::skip);
  EXPECT_EQ(bench.encoder().address(), 1);
  EXPECT_EQ(bench.encoder().baud(), 19'200u);
}

TEST(Raa38ModbusDevice, SeveralSlavesAnswerA0AtOnce) {
  Bench bench;
  const VirtualEncoder& other = bench.add({.address = 6});
  EXPECT_NE(bench.raw({0xFF, 0xA0, 0x40, 0x38}), (Wire{0xFF, 0xA0, 0x01, 0xF8, 0x30}));
  EXPECT_EQ(bench.body({6, 3, 0, 0, 0, 1}), (Wire{6, 3, 2, 0, 0}));
  EXPECT_EQ(bench.encoder().violation_count() + other.violation_count(), 0u) << "what slaves do is not the host's";
}

}  // namespace
}  // namespace absenc::raa38::rtu
