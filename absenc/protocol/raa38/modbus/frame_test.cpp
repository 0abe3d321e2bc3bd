// SPDX-License-Identifier: Apache-2.0
#include "absenc/core/hex.hpp"
#include "absenc/protocol/raa38/modbus/bench_test.hpp"
#include "absenc/protocol/raa38/modbus/host.hpp"

namespace absenc::raa38::rtu {
namespace {

using testing::framed;
using testing::says;
using testing::Wire;

constexpr Format fine{.bits = 21};
constexpr Request one_register{};
constexpr Request two_registers{.registers = 2};
constexpr Request ask{.function = function::read_address, .address = any_address};

Error error_of(const Format& format, const Request& request, const Wire& body) {
  return decode_reply(format, request, framed(body)).error();
}

static_assert(Format{.bits = 16}.register_count() == 1 && Format{.bits = 17}.register_count() == 2);
static_assert(Format{.bits = 14, .registers = 2}.register_count() == 2);

TEST(Raa38ModbusFrame, ByteCountSelectsForm) {
  for (unsigned i = 0; i < 256; ++i) {
    const auto count = static_cast<std::uint8_t>(i);
    EXPECT_EQ(error_of({}, one_register, {1, 3, count, 0x01, 0x7F}), i == 2 ? Error::none : Error::wrong_length);
    const Error nine = error_of(fine, two_registers, {1, 3, count, 0, 0x1F, 0xAB, 0xCD});
    EXPECT_EQ(nine, i == 4 ? Error::none : Error::wrong_length) << i;
    const Error eight = error_of(fine, two_registers, {1, 3, count, 0x1F, 0xAB, 0xCD});
    EXPECT_EQ(eight, i == 3 || i == 4 ? Error::none : Error::wrong_length) << i;
    const Error ten = error_of(fine, two_registers, {1, 3, count, 0, 0, 0x1F, 0xAB, 0xCD});
    EXPECT_EQ(ten, Error::wrong_length) << i;
  }
}

TEST(Raa38ModbusFrame, RejectsPositionWithTooManyBits) {
  for (unsigned bits = 10; bits <= 21; ++bits) {
    const auto most = static_cast<std::uint32_t>(low_mask(bits));
    for (const std::uint32_t position : {most, most + 1}) {
      const auto byte = [&](unsigned i) { return static_cast<std::uint8_t>(position >> 8 * i); };
      const Error error = error_of({.bits = bits}, two_registers, {1, 3, 4, byte(3), byte(2), byte(1), byte(0)});
      EXPECT_EQ(error, position == most ? Error::none : Error::out_of_range) << bits;
    }
  }
}

TEST(Raa38ModbusFrame, AcceptsSwappedCrcOnlyInReplyToA0) {
  EXPECT_EQ(decode_reply({}, ask, hex<"ffa00130f8">)->order, CrcOrder::high_first);
  EXPECT_EQ(decode_reply({}, ask, hex<"ffa001f830">)->order, CrcOrder::low_first);
  const auto error = [](const Request& request, Bytes reply) { return decode_reply({}, request, reply).error(); };
  EXPECT_EQ(error(ask, hex<"ffa00130f9">), Error::bad_checksum);
  EXPECT_EQ(error({.function = function::set_address, .value = 2}, hex<"02a168c1">), Error::bad_checksum);
  EXPECT_EQ(error({.function = function::set_parameter, .value = 1}, hex<"01cc01c0b4">), Error::bad_checksum);
  EXPECT_EQ(error(one_register, hex<"0183023f0e">), Error::bad_checksum);
  EXPECT_EQ(decode_request(hex<"0103000000010a84">).error(), Error::bad_checksum);
  EXPECT_EQ(decode_request(hex<"ffa03840">).error(), Error::bad_checksum);
}

TEST(Raa38ModbusFrame, ChecksAddressRangeAndExplainsEachRefusal) {
  for (unsigned i = 0; i < 256; ++i) {
    const auto byte = static_cast<std::uint8_t>(i);
    EXPECT_EQ(error_of({}, ask, {0xFF, 0xA0, byte}), i >= 1 && i <= 247 ? Error::none : Error::out_of_range) << i;
    const Wire refusal = framed({1, 0x83, byte});
    EXPECT_EQ(decode_reply({}, one_register, refusal).error(), Error::request_rejected) << i;
    EXPECT_TRUE(says(explain({}, Error::request_rejected, hex<"010300000001840a">, refusal).detail, "exception")) << i;
  }
  EXPECT_EQ(error_of({}, ask, {0x01, 0xA0, 0x01}), Error::unexpected_reply);
  EXPECT_EQ(error_of({}, one_register, {2, 0x83, 2}), Error::unexpected_reply);
  // A refusal of function CC cannot be recognized, because it would equal the reply to another parameter.
  EXPECT_EQ(error_of({}, {.function = function::set_parameter, .value = 0x19}, {1, 0xCC, 1}), Error::unexpected_reply);
}

TEST(Raa38ModbusFrame, ChecksRequests) {
  EXPECT_EQ(decode_request(hex<"0103">).error(), Error::wrong_length);
  EXPECT_EQ(decode_request(hex<"01030000000184">).error(), Error::wrong_length);
  EXPECT_EQ(decode_request(framed({1, 6, 0, 0, 0, 1})).error(), Error::unsupported);
  EXPECT_EQ(decode_request(framed({1, 0xA0})).error(), Error::unexpected_reply);
  EXPECT_EQ(error_of({}, {.first_register = 5, .registers = 2}, {1, 3, 4, 0, 0, 0, 1}), Error::unsupported);
}

TEST(Raa38ModbusFrame, AssumesRequestFromReply) {
  EXPECT_EQ(assumed_request({}, hex<"010302017ff834">).registers, 1);
  EXPECT_EQ(assumed_request({}, hex<"010304001fabcd7550">).registers, 2);
  EXPECT_EQ(assumed_request({}, hex<"02a1c168">).value, 2);
  EXPECT_EQ(assumed_request({}, hex<"01cc96f56e">).value, 0x96);
  EXPECT_EQ(assumed_request({}, {}).function, function::read);
}

// A valid frame stays valid if a 00 is appended, so the CRC does not prove whether a reply has three or four bytes of
// data.
TEST(Raa38ModbusFrame, RecognizesLengthThatTheCrcDoesNotProve) {
  Wire followed = framed({1, 3, 4, 0x00, 0x00, 0x05});
  EXPECT_TRUE(decode_reply(fine, two_registers, followed));
  EXPECT_TRUE(length_is_doubtful(followed));
  followed.push_back(0);
  EXPECT_EQ(modbus::crc_order(followed), CrcOrder::low_first);
  EXPECT_TRUE(length_is_doubtful(followed));
  for (const Bytes certain :
       {Bytes(hex<"010304001fabcd7550">), Bytes(hex<"0103031fabcdcaed">), Bytes(hex<"010302017ff834">)}) {
    EXPECT_FALSE(length_is_doubtful(certain));
  }
}

TEST(Raa38ModbusFrame, FindsFrameEndWithoutSilence) {
  struct Row {
    Direction way;
    Wire bytes;
    FrameEnd::Kind kind;
    std::size_t size = 0;
  };
  using enum FrameEnd::Kind;
  const Row rows[]{
      {Direction::request, {0x01, 0x03, 0, 0, 0, 1, 0x84, 0x0A, 0x01}, complete, 8},
      {Direction::request, {0xFF, 0xA0, 0x40, 0x38, 0x01}, complete, 4},
      {Direction::request, {0x01, 0x06, 0, 0}, no_frame},
      {Direction::request, {0x01, 0x83, 0, 0}, no_frame},
      {Direction::reply, {0x01, 0x83, 0x02, 0xC0, 0xF1, 0x01}, complete, 5},
      {Direction::reply, {0x09, 0x03, 0x02}, incomplete, 7},
      {Direction::reply, {0x01, 0x03, 0x04, 0x1F, 0xAB, 0xCD, 0xCB, 0x99, 0x01}, complete, 8},
      {Direction::reply, {0x01, 0x03, 0x04, 0x1F, 0xAB, 0xCD, 0xCB, 0x99, 0x00}, complete, 8},
  };
  for (const Row& row : rows) {
    const FrameEnd end = modbus_unit.frame_end(options_of({}), row.way, row.bytes);
    EXPECT_EQ(end.kind, row.kind);
    EXPECT_TRUE(row.size == 0 || end.size == row.size) << end.size;
  }
}

struct Evidence final : EvidenceSink {
  void put(const OptionEvidence& one) override {
    possible += one.possible ? 1 : 0;
    reasons += std::string(one.why) + "\n";
  }
  unsigned possible = 0;
  std::string reasons;
};

TEST(Raa38ModbusProbe, FindsRegistersAndLeastBits) {
  Options options = options_of({});
  Evidence evidence;
  ASSERT_TRUE(modbus_unit.probe(options, std::vector<Capture>{{{}, hex<"010304001fabcd7550">}}, evidence));
  EXPECT_EQ(options.values, options_of(fine).values) << "two registers are what so many bits need";
  // three option values are possible: 21 for the option bits, auto and 2 for the option registers
  EXPECT_EQ(evidence.possible, 3u);
  const std::vector<Capture> damaged{{{}, hex<"010302017ff834">}, {{}, hex<"010302017ff835">}};
  EXPECT_FALSE(modbus_unit.probe(options, damaged, evidence));
  EXPECT_TRUE(says(evidence.reasons, "checksum"));
}

TEST(Raa38ModbusFrame, RejectsReadingsOfOtherRegisters) {
  EXPECT_EQ(decode_reply({}, {.registers = 0}, hex<"01030020f0">).error(), Error::unsupported);
  EXPECT_EQ(decode_reply({}, {.registers = 3}, hex<"010306000000000005e176">).error(), Error::unsupported);
}

TEST(Raa38ModbusFrame, ExplainsNothingForShortReply) {
  EXPECT_EQ(explain({}, Error::unexpected_reply, hex<"010300000001840a">, hex<"01">).detail, "");
}

}  // namespace
}  // namespace absenc::raa38::rtu
