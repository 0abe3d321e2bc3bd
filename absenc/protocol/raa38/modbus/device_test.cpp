// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "absenc/protocol/raa38/modbus/bench_test.hpp"

namespace absenc::raa38::rtu {
namespace {

using testing::Bench;
using testing::PowerOn;
using testing::Talk;
using Wire = std::vector<std::uint8_t>;

// The frame without its CRC, which must be good.
Wire body(const Wire& frame) {
  if (frame.empty()) return {};
  EXPECT_EQ(modbus::crc_order(frame), CrcOrder::low_first);
  return {frame.begin(), frame.end() - 2};
}

TEST(Raa38ModbusDevice, AnswersAsTheManualShows) {
  Bench bench;
  bench.put_shaft(383);
  EXPECT_EQ(bench.raw({0x01, 0x03, 0x00, 0x00, 0x00, 0x01, 0x84, 0x0A}), (Wire{1, 3, 2, 0x01, 0x7F, 0xF8, 0x34}));
  EXPECT_EQ(body(bench.raw({0x01, 0x03, 0x00, 0x00, 0x00, 0x02, 0xC4, 0x0B})), (Wire{1, 3, 4, 0, 0, 0x01, 0x7F}));
  EXPECT_EQ(bench.raw({0xFF, 0xA0, 0x40, 0x38}), (Wire{0xFF, 0xA0, 0x01, 0xF8, 0x30}));
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(Raa38ModbusDevice, RefusesAsTheStandardSays) {
  Bench bench;
  EXPECT_EQ(body(bench.raw_body({1, 4, 0, 0, 0, 1})), (Wire{1, 0x84, 1}));  // input registers
  EXPECT_EQ(body(bench.raw_body({1, 1, 0, 0, 0, 1})), (Wire{1, 0x81, 1}));  // coils
  EXPECT_EQ(body(bench.raw_body({1, 6, 0, 0, 0, 1})), (Wire{1, 0x86, 1}));  // write a register
  EXPECT_EQ(body(bench.raw_body({1, 0x11})), (Wire{1, 0x91, 1}));           // report server id
  EXPECT_EQ(body(bench.raw_body({1, 3, 0, 1, 0, 1})), (Wire{1, 0x83, 2}));  // register 1
  EXPECT_EQ(body(bench.raw_body({1, 3, 0, 0, 0, 3})), (Wire{1, 0x83, 2}));  // three registers
  EXPECT_EQ(body(bench.raw_body({1, 3, 0xFF, 0xFF, 0, 1})), (Wire{1, 0x83, 2}));
  EXPECT_EQ(body(bench.raw_body({1, 3, 0, 0, 0, 0})), (Wire{1, 0x83, 3}));    // none
  EXPECT_EQ(body(bench.raw_body({1, 3, 0, 0, 0, 126})), (Wire{1, 0x83, 3}));  // more than a frame holds
  EXPECT_EQ(body(bench.raw_body({1, 3, 0, 0})), (Wire{1, 0x83, 3}));          // no request of this function
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(Raa38ModbusDevice, APartOfThePositionIsNotGiven) {
  Bench bench({.bits = 17});
  EXPECT_EQ(body(bench.raw_body({1, 3, 0, 0, 0, 1})), (Wire{1, 0x83, 3}));
  bench.put_shaft(0x1FFFF);
  EXPECT_EQ(body(bench.raw_body({1, 3, 0, 0, 0, 2})), (Wire{1, 3, 4, 0, 1, 0xFF, 0xFF}));
}

TEST(Raa38ModbusDevice, AllFormsOfTheManual) {
  Bench three({.bits = 21, .data = Data::three_bytes});
  three.put_shaft(0x1FABCD);
  EXPECT_EQ(body(three.raw_body({1, 3, 0, 0, 0, 2})), (Wire{1, 3, 3, 0x1F, 0xAB, 0xCD}));
  Bench short_of_one({.bits = 21, .data = Data::three_as_four});
  short_of_one.put_shaft(0x1FABCD);
  EXPECT_EQ(body(short_of_one.raw_body({1, 3, 0, 0, 0, 2})), (Wire{1, 3, 4, 0x1F, 0xAB, 0xCD}));
}

TEST(Raa38ModbusDevice, IsSilentToWhatIsNotForIt) {
  Bench bench;
  EXPECT_TRUE(bench.raw_body({2, 3, 0, 0, 0, 1}).empty());
  EXPECT_TRUE(bench.raw_body({0, 3, 0, 0, 0, 1}).empty()) << "broadcast";
  EXPECT_TRUE(bench.raw_body({0xFF, 3, 0, 0, 0, 1}).empty());
  EXPECT_TRUE(bench.raw_body({1, 0xA0}).empty()) << "A0 is asked of FF";
  EXPECT_TRUE(bench.raw_body({1, 0x83, 2}).empty()) << "the refusal of another";
  EXPECT_TRUE(bench.raw({0x01, 0x03, 0x00, 0x00, 0x00, 0x01, 0x0A, 0x84}).empty()) << "CRC the other way round";
  EXPECT_TRUE(bench.raw_body({1, 0xA1}).empty());
  EXPECT_TRUE(bench.raw_body({1, 0xCC, 1, 1}).empty());
  EXPECT_EQ(bench.encoder.answered(), 0u);
  EXPECT_EQ(bench.encoder.writes(), 0u);
}

TEST(Raa38ModbusDevice, SettingsSurvivePowerOff) {
  Bench bench;
  bench.put_shaft(1000);
  EXPECT_EQ(body(bench.raw_body({1, 0xCC, 0x00})), (Wire{1, 0xCC, 0x00}));
  EXPECT_EQ(body(bench.raw_body({1, 0xCC, 0x02})), (Wire{1, 0xCC, 0x02}));
  EXPECT_EQ(body(bench.raw_body({1, 0xA1, 9})), (Wire{9, 0xA1}));
  bench.put_shaft(1010);
  EXPECT_EQ(body(bench.raw_body({9, 3, 0, 0, 0, 1})), (Wire{9, 3, 2, 0x3F, 0xF6})) << "10 counts backwards";
  EXPECT_EQ(bench.encoder.writes(), 3u);
  bench.encoder.power_off(bench.line.now());
  EXPECT_TRUE(bench.raw_body({9, 3, 0, 0, 0, 1}).empty());
  bench.encoder.power_on(bench.line.now(), PowerOn::real);
  EXPECT_EQ(body(bench.raw_body({9, 3, 0, 0, 0, 1})), (Wire{9, 3, 2, 0x3F, 0xF6}));
  EXPECT_EQ(body(bench.raw_body({9, 0xCC, 0x01})), (Wire{9, 0xCC, 0x01}));
  EXPECT_EQ(body(bench.raw_body({9, 3, 0, 0, 0, 1})), (Wire{9, 3, 2, 0, 10}));
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(Raa38ModbusDevice, ABaudRateHoldsFromTheReplyOn) {
  for (std::size_t i = 0; i < bauds.size(); ++i) {
    if (i == baud_at_shipping) continue;
    Bench bench;
    EXPECT_EQ(body(bench.raw_body({1, 0xCC, baud_parameters[i]})), (Wire{1, 0xCC, baud_parameters[i]}));
    EXPECT_EQ(bench.encoder.baud(), bauds[i]);
    EXPECT_TRUE(bench.raw_body({1, 3, 0, 0, 0, 1}).empty()) << "it listens at " << bauds[i];
    Talk read({.baud = i}, "position");
    struct At final : Machine<std::uint8_t> {
      At(Machine<std::uint8_t>& inner, LineSettings line) : inner_(inner), line_(line) {}
      void feed(const Event<std::uint8_t>& event) override { inner_.feed(event); }
      Step<std::uint8_t> next(Time now) override {
        using Kind = Step<std::uint8_t>::Kind;
        return std::exchange(set_, true) ? inner_.next(now)
                                         : Step<std::uint8_t>{.kind = Kind::configure, .settings = line_};
      }
      Machine<std::uint8_t>& inner_;
      LineSettings line_;
      bool set_ = false;
    } at(read, {.rate = bauds[i]});
    bench.run(at);
    EXPECT_EQ(read.error(), Error::none) << bauds[i];
    bench.encoder.power_off(bench.line.now());
    bench.encoder.power_on(bench.line.now(), PowerOn::skip);
    EXPECT_EQ(bench.encoder.baud(), bauds[i]);
  }
}

TEST(Raa38ModbusDevice, WearIsTold) {
  Bench bench;
  bench.raw_body({1, 0xCC, 0x02});
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
  bench.raw_body({1, 0xCC, 0x02});
  ASSERT_EQ(bench.encoder.violation_count(), 1u);
  EXPECT_NE(bench.encoder.violations()[0].rule.find("has already"), std::string_view::npos);
  EXPECT_EQ(bench.encoder.writes(), 2u);
  for (unsigned i = 0; i < 12; ++i) bench.raw_body({1, 0xCC, static_cast<std::uint8_t>(1 + i % 2)});
  ASSERT_EQ(bench.encoder.violation_count(), 2u);
  EXPECT_NE(bench.encoder.violations()[1].rule.find("again and again"), std::string_view::npos);
}

TEST(Raa38ModbusDevice, WhatCannotBeSetIsTold) {
  Bench bench;
  EXPECT_TRUE(bench.raw_body({1, 0xA1, 0}).empty());
  EXPECT_TRUE(bench.raw_body({1, 0xA1, 248}).empty());
  EXPECT_TRUE(bench.raw_body({1, 0xCC, 0x33}).empty());
  EXPECT_EQ(bench.encoder.violation_count(), 3u);
  EXPECT_EQ(bench.encoder.writes(), 0u);
}

TEST(Raa38ModbusDevice, AMemoryOfRubbishIsNotTakenOver) {
  Bench bench;
  bench.encoder.power_off(bench.line.now());
  for (std::uint8_t& byte : bench.encoder.memory()) byte = 0xFF;
  bench.encoder.power_on(bench.line.now(), PowerOn::skip);
  EXPECT_EQ(bench.encoder.address(), 1);
  EXPECT_EQ(bench.encoder.baud(), 19'200u);
}

TEST(Raa38ModbusDevice, SeveralAnswerA0AtOnce) {
  Bench bench;
  VirtualEncoder other({.address = 6}, bench.shaft);
  bench.put_on_line(other);
  EXPECT_NE(bench.raw({0xFF, 0xA0, 0x40, 0x38}), (Wire{0xFF, 0xA0, 0x01, 0xF8, 0x30}));
  EXPECT_EQ(body(bench.raw_body({6, 3, 0, 0, 0, 1})), (Wire{6, 3, 2, 0, 0}));
  EXPECT_EQ(bench.encoder.violation_count() + other.violation_count(), 0u) << "what the slaves do is not the host's";
}

}  // namespace
}  // namespace absenc::raa38::rtu
