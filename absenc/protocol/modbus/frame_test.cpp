// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/modbus/frame.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <vector>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/modbus/timing.hpp"

namespace absenc::modbus {
namespace {

TEST(ModbusFrame, AppendsCrcLowByteFirst) {
  FrameBytes frame;
  frame.append(hex<"010300000001">);
  append_crc(frame);
  EXPECT_TRUE(std::ranges::equal(frame.view(), hex<"010300000001840a">));
  EXPECT_EQ(crc_order(frame), CrcOrder::low_first);
}

TEST(ModbusFrame, RecognizesCrcOfOtherByteOrder) {
  EXPECT_EQ(crc_order(hex<"0103000000010a84">), CrcOrder::high_first);
  EXPECT_EQ(crc_order(hex<"0103000000010a85">), CrcOrder::wrong);
  EXPECT_EQ(crc_order(hex<"ffff">), CrcOrder::wrong);  // a CRC without a frame is invalid
  EXPECT_EQ(crc_order({}), CrcOrder::wrong);
}

// MODBUS over Serial Line, 6.2.2: the CRC must detect one or two wrong bits at any place of a frame of nine bytes.
TEST(ModbusFrame, DetectsAnyTwoWrongBits) {
  const std::vector<std::uint8_t> good(hex<"010304001fabcd7550">.begin(), hex<"010304001fabcd7550">.end());
  for (std::size_t one = 0; one < good.size() * 8; ++one) {
    for (std::size_t other = one; other < good.size() * 8; ++other) {
      std::vector<std::uint8_t> bad = good;
      bad[one / 8] ^= static_cast<std::uint8_t>(1u << one % 8);
      if (other != one) bad[other / 8] ^= static_cast<std::uint8_t>(1u << other % 8);
      EXPECT_NE(crc_order(bad), CrcOrder::low_first) << one << " " << other;
    }
  }
}

TEST(ModbusFrame, RecognizesRefusals) {
  EXPECT_EQ(refusal_code(hex<"018302c0f1">, read_holding_registers), 2);
  EXPECT_FALSE(refusal_code(hex<"010302017ff834">, read_holding_registers));
  EXPECT_FALSE(refusal_code(hex<"018302c0">, read_holding_registers));
  EXPECT_FALSE(refusal_code(hex<"018402c0f1">, read_holding_registers));
}

TEST(ModbusFrame, ExplainsEachRefusalCode) {
  std::set<std::string> words;
  for (const std::uint8_t code : std::to_array<std::uint8_t>({1, 2, 3, 4, 5, 6, 8, 10, 11, 0x77})) {
    const Explanation explanation = explain_refusal(code);
    EXPECT_FALSE(explanation.advice.empty());
    words.insert(std::string(explanation.detail));
  }
  EXPECT_EQ(words.size(), 10u);
  EXPECT_NE(words.begin()->find("exception"), std::string::npos);
}

TEST(ModbusTiming, SilencesShrinkWithCharactersUpTo19200) {
  EXPECT_EQ(frame_silence({.rate = 2400}), Time(14'583'334));  // 3.5 characters of 10 bits at 2400 baud
  EXPECT_EQ(character_gap({.rate = 2400}), Time(6'250'000));
  EXPECT_EQ(frame_silence({.rate = 19'200}).count() / 1000, 1822);
  EXPECT_EQ(frame_silence({.rate = 57'600}), Time(1'750'000));
  EXPECT_EQ(character_gap({.rate = 57'600}), Time(750'000));
  EXPECT_GT(frame_silence({.rate = 19'200, .parity = Parity::even}), frame_silence({.rate = 19'200}));
}

}  // namespace
}  // namespace absenc::modbus
