// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/modbus/frame.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/raa38/modbus/explain.hpp"
#include "absenc/protocol/raa38/modbus/options.hpp"
#include "absenc/protocol/raa38/unit.hpp"

namespace absenc::raa38::rtu {
namespace {

constexpr Request one_register{};
constexpr Request two_registers{.registers = 2};

modbus::FrameBytes frame(std::initializer_list<int> body) {
  modbus::FrameBytes bytes;
  for (const int byte : body) bytes.push_back(static_cast<std::uint8_t>(byte));
  modbus::append_crc(bytes);
  return bytes;
}

Error error_of(const Format& format, const Request& request, Bytes reply) {
  return decode_reply(format, request, reply).error();
}

TEST(Raa38ModbusFrame, RequestsOfTheManual) {
  EXPECT_TRUE(std::ranges::equal(encode_request({}).view(), hex<"010300000001840a">));
  EXPECT_TRUE(std::ranges::equal(encode_request(two_registers).view(), hex<"010300000002c40b">));
  EXPECT_TRUE(std::ranges::equal(encode_request({.function = function::ask_address, .address = any_address}).view(),
                                 hex<"ffa04038">));
  EXPECT_TRUE(
      std::ranges::equal(encode_request({.function = function::set_address, .value = 2}).view(), hex<"01a102d851">));
}

TEST(Raa38ModbusFrame, RegistersFollowTheBits) {
  EXPECT_EQ(Format{.bits = 16}.asked(), 1u);
  EXPECT_EQ(Format{.bits = 17}.asked(), 2u);
  EXPECT_EQ((Format{.bits = 14, .registers = 2}.asked()), 2u);
}

TEST(Raa38ModbusFrame, OneRegisterHasByteCountTwo) {
  for (int count = 0; count < 256; ++count) {
    const Error error = error_of({.bits = 14}, one_register, frame({1, 3, count, 0x01, 0x7F}));
    EXPECT_EQ(error, count == 2 ? Error::none : Error::wrong_length) << count;
  }
}

TEST(Raa38ModbusFrame, TwoRegistersComeInThreeForms) {
  const Format format{.bits = 21};
  for (int count = 0; count < 256; ++count) {
    const Error nine = error_of(format, two_registers, frame({1, 3, count, 0, 0x1F, 0xAB, 0xCD}));
    EXPECT_EQ(nine, count == 4 ? Error::none : Error::wrong_length) << count;
    const Error eight = error_of(format, two_registers, frame({1, 3, count, 0x1F, 0xAB, 0xCD}));
    EXPECT_EQ(eight, count == 3 || count == 4 ? Error::none : Error::wrong_length) << count;
  }
  EXPECT_EQ(decode_reply(format, two_registers, frame({1, 3, 4, 0x1F, 0xAB, 0xCD}))->singleturn, 0x1FABCDu);
  EXPECT_EQ(decode_reply(format, two_registers, frame({1, 3, 3, 0x1F, 0xAB, 0xCD}))->singleturn, 0x1FABCDu);
  EXPECT_EQ(decode_reply(format, two_registers, frame({1, 3, 4, 0, 0x1F, 0xAB, 0xCD}))->singleturn, 0x1FABCDu);
  EXPECT_EQ(error_of(format, two_registers, frame({1, 3, 4, 0, 0, 0x1F, 0xAB, 0xCD})), Error::wrong_length);
}

TEST(Raa38ModbusFrame, ThePositionFitsItsBits) {
  for (unsigned bits = 10; bits <= 21; ++bits) {
    const auto most = static_cast<std::uint32_t>(low_mask(bits));
    for (const std::uint32_t position : {most, most + 1}) {
      const auto byte = [&](unsigned i) { return static_cast<int>(position >> 8 * i & 0xFF); };
      const Error error = error_of({.bits = bits}, two_registers, frame({1, 3, 4, byte(3), byte(2), byte(1), byte(0)}));
      EXPECT_EQ(error, position == most ? Error::none : Error::out_of_range) << bits;
    }
  }
}

TEST(Raa38ModbusFrame, OnlyTheAddressMayComeWithTheCrcTheOtherWayRound) {
  const Request ask{.function = function::ask_address, .address = any_address};
  EXPECT_EQ(decode_reply({}, ask, hex<"ffa00130f8">)->order, CrcOrder::high_first);
  EXPECT_EQ(decode_reply({}, ask, hex<"ffa001f830">)->order, CrcOrder::low_first);
  EXPECT_EQ(error_of({}, ask, hex<"ffa00130f9">), Error::bad_checksum);
  EXPECT_EQ(error_of({}, {.function = function::set_address, .value = 2}, hex<"02a168c1">), Error::bad_checksum);
  EXPECT_EQ(error_of({}, {.function = function::set_parameter, .value = 1}, hex<"01cc01c0b4">), Error::bad_checksum);
  EXPECT_EQ(error_of({}, one_register, hex<"0183023f0e">), Error::bad_checksum);
  EXPECT_EQ(decode_request(hex<"0103000000010a84">).error(), Error::bad_checksum);
  EXPECT_EQ(decode_request(hex<"ffa03840">).error(), Error::bad_checksum);
}

TEST(Raa38ModbusFrame, AnAddressIsFrom1To247) {
  const Request ask{.function = function::ask_address, .address = any_address};
  for (int address = 0; address < 256; ++address) {
    const bool good = address >= 1 && address <= 247;
    EXPECT_EQ(error_of({}, ask, frame({0xFF, 0xA0, address})), good ? Error::none : Error::out_of_range) << address;
  }
  EXPECT_EQ(error_of({}, ask, frame({0x01, 0xA0, 0x01})), Error::unexpected_reply);
}

TEST(Raa38ModbusFrame, EveryRefusalIsOneAndHasWords) {
  for (int code = 1; code < 256; ++code) {
    const auto reply = frame({1, 0x83, code});
    EXPECT_EQ(error_of({}, one_register, reply), Error::request_rejected) << code;
    const Explanation explanation = explain(one_register, Error::request_rejected, reply);
    EXPECT_NE(explanation.found.find("exception"), std::string_view::npos);
  }
  EXPECT_EQ(error_of({}, one_register, frame({2, 0x83, 2})), Error::unexpected_reply);
  // To CC it would look like an echo.
  EXPECT_EQ(error_of({}, {.function = function::set_parameter, .value = 0x19}, frame({1, 0xCC, 1})),
            Error::unexpected_reply);
}

TEST(Raa38ModbusFrame, RequestsAreCheckedToo) {
  EXPECT_EQ(decode_request(hex<"0103">).error(), Error::wrong_length);
  EXPECT_EQ(decode_request(hex<"01030000000184">).error(), Error::wrong_length);
  EXPECT_EQ(decode_request(frame({1, 6, 0, 0, 0, 1})).error(), Error::unsupported);
  EXPECT_EQ(decode_request(frame({1, 0xA0})).error(), Error::unexpected_reply);
  EXPECT_EQ(decode_request(frame({9, 3, 0, 5, 0, 2}))->first_register, 5);
  EXPECT_EQ(error_of({}, {.first_register = 5, .registers = 2}, frame({1, 3, 4, 0, 0, 0, 1})), Error::unsupported);
}

TEST(Raa38ModbusFrame, WithoutTheRequestTheReplyTells) {
  EXPECT_EQ(assumed_request({}, hex<"010302017ff834">).registers, 1);
  EXPECT_EQ(assumed_request({}, hex<"010304001fabcd7550">).registers, 2);
  EXPECT_EQ(assumed_request({}, hex<"02a1c168">).value, 2);
  EXPECT_EQ(assumed_request({}, hex<"01cc96f56e">).value, 0x96);
  EXPECT_EQ(assumed_request({}, {}).function, function::read);
}

// A CRC followed by a 00 is a CRC again.
TEST(Raa38ModbusFrame, ALengthThatTheCrcDoesNotTell) {
  const Format format{.bits = 21};
  modbus::FrameBytes followed = frame({1, 3, 4, 0x00, 0x00, 0x05});
  followed.push_back(0);
  EXPECT_EQ(error_of(format, two_registers, followed.view().first(8)), Error::none);
  EXPECT_EQ(modbus::crc_order(followed), CrcOrder::low_first);
  EXPECT_TRUE(length_is_doubtful(followed));
  EXPECT_TRUE(length_is_doubtful(followed.view().first(8)));
  EXPECT_FALSE(length_is_doubtful(hex<"010304001fabcd7550">));
  EXPECT_FALSE(length_is_doubtful(hex<"0103031fabcdcaed">));
  EXPECT_FALSE(length_is_doubtful(hex<"010302017ff834">));
}

TEST(Raa38ModbusFrame, EndsAreFoundInARun) {
  Options options;
  ASSERT_EQ(resolve_options(modbus_unit, {}, {}, options).kind, OptionError::Kind::none);
  const auto end = [&](Direction way, std::vector<std::uint8_t> bytes) {
    return modbus_unit.delimit(options, way, bytes);
  };
  EXPECT_EQ(end(Direction::request, {0x01, 0x03, 0, 0, 0, 1, 0x84, 0x0A, 0x01}).size, 8u);
  EXPECT_EQ(end(Direction::request, {0xFF, 0xA0, 0x40, 0x38, 0x01}).size, 4u);
  EXPECT_EQ(end(Direction::request, {0x01, 0x06, 0, 0}).kind, Delimit::Kind::no_frame);
  EXPECT_EQ(end(Direction::request, {0x01, 0x83, 0, 0}).kind, Delimit::Kind::no_frame);
  EXPECT_EQ(end(Direction::reply, {0x01, 0x83, 0x02, 0xC0, 0xF1, 0x01}).size, 5u);
  EXPECT_EQ(end(Direction::reply, {0x09, 0x03, 0x02}).kind, Delimit::Kind::incomplete);
  EXPECT_EQ(end(Direction::reply, {0x01, 0x03, 0x04, 0x1F, 0xAB, 0xCD, 0xCB, 0x99, 0x01}).size, 8u);
  EXPECT_EQ(end(Direction::reply, {0x01, 0x03, 0x04, 0x1F, 0xAB, 0xCD, 0xCB, 0x99, 0x00}).size, 8u);
}

struct Evidence final : EvidenceSink {
  void put(const OptionEvidence& one) override {
    if (one.possible) possible.push_back({one.option, one.value});
    if (!one.possible) reasons.emplace_back(one.why);
  }
  std::vector<std::pair<std::size_t, std::int64_t>> possible;
  std::vector<std::string> reasons;
};

TEST(Raa38ModbusProbe, FramesTellRegistersAndHowManyBitsAtLeast) {
  Options options;
  ASSERT_EQ(resolve_options(modbus_unit, {}, {}, options).kind, OptionError::Kind::none);
  Evidence evidence;
  const std::vector<Capture> captures{{{}, hex<"010304001fabcd7550">}};
  ASSERT_TRUE(modbus_unit.probe(options, captures, evidence));
  EXPECT_EQ(rtu::options.format(options).bits, 21u);
  EXPECT_EQ(rtu::options.format(options).asked(), 2u);
  EXPECT_EQ(evidence.possible.size(), 3u);  // 21 bits; auto and 2 registers
}

TEST(Raa38ModbusProbe, ADamagedFrameIsExplainedByNothing) {
  Options options;
  ASSERT_EQ(resolve_options(modbus_unit, {}, {}, options).kind, OptionError::Kind::none);
  Evidence evidence;
  const std::vector<Capture> captures{{{}, hex<"010302017ff834">}, {{}, hex<"010302017ff835">}};
  EXPECT_FALSE(modbus_unit.probe(options, captures, evidence));
  EXPECT_TRUE(std::ranges::any_of(evidence.reasons, [](const auto& why) { return why.find("checksum") != why.npos; }));
}

}  // namespace
}  // namespace absenc::raa38::rtu
