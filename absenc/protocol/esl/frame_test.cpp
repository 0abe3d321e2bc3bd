// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/reply.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <vector>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/author/known_test.hpp"
#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/esl/unit.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::esl {
namespace {

constexpr std::array all_ids{DataId::position,         DataId::singleturn,      DataId::position_short,
                             DataId::singleturn_short, DataId::calibration,     DataId::encoder_id,
                             DataId::temperature,      DataId::alarms,          DataId::zero,
                             DataId::clear_alarms,     DataId::reset_multiturn, DataId::read_memory,
                             DataId::write_memory};

constexpr std::array<std::uint8_t, 9> check_input{'1', '2', '3', '4', '5', '6', '7', '8', '9'};

// Returns all combinations of the options for properties that the document leaves open. Option sequence_step is left
// out, because it changes no frame.
std::vector<Profile> all_profiles() {
  std::vector<Profile> profiles{Profile{}};
  for (std::size_t option = 0; option < open_options; ++option) {
    if (option == options.find("sequence_step")) continue;
    std::vector<Profile> more;
    for (const Profile& profile : profiles) {
      for (std::size_t value = 0; value < options.infos[option].choices.size(); ++value) {
        more.push_back(profile);
        options.put(more.back(), option, static_cast<std::int64_t>(value));
      }
    }
    profiles = more;
  }
  return profiles;
}

// Returns a reply with values in all parts that its data ID carries.
Reply sample(DataId id, const Profile& profile = {}) {
  Reply reply{.id = id,
              .encoder_address = 3,
              .one = {status::ready | status::non_safety_error, alarms::overspeed, 0xD5, 0xD8},
              .two = {status::ready | status::channel_2, alarms::xc_error | alarms::over_voltage, 0x55, 0xD8},
              .singleturn = 0xABCDEF,
              .multiturn = 0xFEDC,
              .redundant = 0xABCDEF >> 15,
              .temperature = -10,
              .memory_address = 0x55,
              .value = 0xA7};
  if (id == DataId::calibration && profile.id6_rs == Id6Redundant::bits_16) reply.redundant = 0xABCD;
  return reply;
}

std::vector<std::uint8_t> wire(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

TEST(EslFrame, ChecksumsOfTheCatalogue) {
  EXPECT_EQ(crc_bitwise(crc8_lsb, check_input), 0x43);
  EXPECT_EQ(crc_bitwise(crc16_lsb, check_input), 0xFAD9);
  CrcParameters channel_2 = crc16_lsb;
  channel_2.init = 0xFFFF;
  EXPECT_EQ(crc_bitwise(channel_2, check_input), 0x328D);
}

TEST(EslFrame, FastChecksumsAreTheDefinition) {
  std::vector<std::uint8_t> bytes;
  for (unsigned i = 0; i < 32; ++i) {
    for (const Channel channel : {Channel::one, Channel::two}) {
      std::vector<std::uint8_t> padded = bytes;
      if (padded.size() % 2 != 0) padded.push_back(0);
      std::vector<std::uint8_t> swapped = padded;
      for (std::size_t at = 0; at < swapped.size(); at += 2) std::swap(swapped[at], swapped[at + 1]);
      CrcParameters lsb = crc16_lsb;
      CrcParameters msb = crc16_msb;
      lsb.init = msb.init = initial_value(channel);
      EXPECT_EQ(checksum16(CrcBitOrder::lsb, channel, bytes), crc_bitwise(lsb, padded));
      EXPECT_EQ(checksum16(CrcBitOrder::msb, channel, bytes), crc_bitwise(msb, padded));
      EXPECT_EQ(checksum16(CrcBitOrder::word, channel, bytes), crc_bitwise(msb, swapped));
    }
    EXPECT_EQ(checksum8(CrcBitOrder::lsb, bytes), crc_bitwise(crc8_lsb, bytes));
    EXPECT_EQ(checksum8(CrcBitOrder::msb, bytes), crc_bitwise(crc8_msb, bytes));
    bytes.push_back(static_cast<std::uint8_t>(i * 73 + 19));
  }
}

TEST(EslFrame, EveryFieldWithEitherParityScope) {
  for (unsigned field = 0; field < 256; ++field) {
    const auto id = static_cast<DataId>(field >> 3 & 0xF);
    EXPECT_EQ(control_field({}, field & 7, id) == field, std::popcount(field >> 3) % 2 == 1) << field;
    EXPECT_EQ(control_field({.parity_scope = ParityScope::all}, field & 7, id) == field, std::popcount(field) % 2 == 1)
        << field;
  }
}

// Bits of the status field (SF) in both orders (Table 5).
TEST(EslFrame, StatusBitsInBothOrders) {
  const Profile tformat{.status_order = FieldOrder::tformat};
  const std::array<std::pair<std::uint8_t, std::uint8_t>, 8> places{{{status::temperature_warning, 0x01},
                                                                     {status::channel_2, 0x02},
                                                                     {status::ready, 0x04},
                                                                     {status::forced_test_passed, 0x08},
                                                                     {status::safety_error, 0x10},
                                                                     {status::non_safety_error, 0x20},
                                                                     {status::parity_error, 0x40},
                                                                     {status::stop_error, 0x80}}};
  for (const auto& [bit, place] : places) {
    EXPECT_EQ(detail::status_to_wire(tformat, bit), place);
    EXPECT_EQ(detail::status_from_wire(tformat, place), bit);
    EXPECT_EQ(detail::status_to_wire({}, bit), bit);
    EXPECT_EQ(detail::status_from_wire({}, bit), bit);
  }
}

TEST(EslFrame, EncodedFramesDecodeInEveryProfile) {
  for (const Profile& profile : all_profiles()) {
    for (const DataId id : all_ids) {
      const Request request{id, 3, 0x55, 0xA7};
      const RequestBytes asked = encode_request(profile, request);
      ASSERT_EQ(asked.size(), request_length(profile, id));
      const Result<Request> back = decode_request(profile, asked);
      ASSERT_TRUE(back.has_value()) << text_of(back.error()).name;
      EXPECT_EQ(wire(encode_request(profile, *back).view()), wire(asked.view()));
      const ReplyBytes bytes = encode_reply(profile, sample(id, profile));
      ASSERT_EQ(bytes.size(), reply_length(id));
      const Result<Reply> reply = decode_reply(profile, request, bytes);
      ASSERT_TRUE(reply.has_value()) << static_cast<int>(id) << text_of(reply.error()).name;
      EXPECT_EQ(wire(encode_reply(profile, *reply).view()), wire(bytes.view()));
    }
  }
}

constexpr Profile known_default{};
constexpr Profile known_other{.crc_bit_order = CrcBitOrder::word,
                              .crc16_byte_order = CrcByteOrder::table12,
                              .rs1_sc2 = RedundantBit::b0,
                              .status_order = FieldOrder::tformat,
                              .request_crc = false};
constexpr Request known_position{DataId::position, 3};
constexpr Request known_calibration{DataId::calibration, 3};

TEST(EslFrame, ReadsKnownProfileLikeAnyProfile) {
  const auto frame = [](const Profile& profile, DataId id) { return wire(encode_reply(profile, sample(id, profile))); };
  author::testing::expect_known_as_any<Protocol, known_default, known_position>(frame({}, DataId::position));
  author::testing::expect_known_as_any<Protocol, known_other, known_position>(frame(known_other, DataId::position));
  author::testing::expect_known_as_any<Protocol, known_default, known_calibration>(frame({}, DataId::calibration));
}

// The 16-bit CRCs of both channels have a Hamming distance of 5.
TEST(EslFrame, DetectsUpToFourWrongBits) {
  sim::Random random(5);
  for (const Profile& profile : all_profiles()) {
    Reply reply = sample(DataId::position);
    reply.singleturn = static_cast<std::uint32_t>(random.below(1 << 24));
    reply.redundant = static_cast<std::uint16_t>(reply.singleturn >> 15);
    const ReplyBytes good = encode_reply(profile, reply);
    ASSERT_TRUE(decode_reply(profile, {DataId::position, 3}, good).has_value());
    for (unsigned tries = 0; tries < 100; ++tries) {
      ReplyBytes bad = good;
      for (std::uint64_t bits = 1 + random.below(4); bits > 0; --bits) {
        const std::uint64_t bit = random.below(144);
        bad[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
      }
      const bool same = wire(bad.view()) == wire(good.view());
      ASSERT_EQ(decode_reply(profile, {DataId::position, 3}, bad).has_value(), same);
    }
  }
}

TEST(EslFrame, EveryCheckHasItsSentence) {
  for (std::size_t i = 1; i < check_texts.size(); ++i) {
    EXPECT_NE(check_texts[i].error, Error::none) << i;
    EXPECT_FALSE(check_texts[i].sentence.empty()) << i;
    for (std::size_t other = 1; other < i; ++other) EXPECT_NE(check_texts[i].sentence, check_texts[other].sentence);
  }
}

// Checks which part of a reading each alarm bit or status bit makes invalid.
TEST(EslFrame, ValidityOfEachPart) {
  Reply reply = sample(DataId::position);
  reply.one = {.status = status::ready};
  reply.two = {.status = status::ready | status::channel_2};
  EXPECT_TRUE(to_reading(reply).singleturn_valid() && to_reading(reply).multiturn_valid && to_reading(reply).ready);
  for (unsigned bit = 0; bit < 8; ++bit) {
    for (const bool first : {true, false}) {
      Reply alarmed = reply;
      (first ? alarmed.one : alarmed.two).alarms = static_cast<std::uint8_t>(1u << bit);
      EXPECT_EQ(to_reading(alarmed).singleturn_valid(), bit == 0 || bit == 1 || bit == 3) << bit;
      EXPECT_EQ(to_reading(alarmed).multiturn_valid, bit > 1) << bit;
      EXPECT_EQ(to_reading(alarmed).alarms, 1u << (first ? bit : 8 + bit));
    }
  }
  Reply starting = reply;
  starting.two.status = status::channel_2;
  EXPECT_FALSE(to_reading(starting).ready);
  EXPECT_FALSE(to_reading(starting).singleturn_valid());
  EXPECT_FALSE(to_reading(starting).multiturn_valid);
  Reply short_reply{.id = DataId::position_short, .one = {.status = status::ready | status::safety_error}};
  EXPECT_FALSE(to_reading(short_reply).singleturn_valid());
  EXPECT_TRUE(to_reading(short_reply).multiturn_valid);
  short_reply.one.status = status::ready | status::non_safety_error;
  EXPECT_TRUE(to_reading(short_reply).singleturn_valid());
  // The status field does not show if turns, Lissajous signals or overspeed cause a non-safety error, so the turns may
  // be valid or not.
  EXPECT_EQ(to_reading(short_reply).multiturn_validity(), Validity::unknown);
  EXPECT_EQ(to_reading({.id = DataId::temperature}).singleturn_bits, 0u);
}

// Each row lists the flags of both channels that replies to a data ID carry: all have the status field (SF), only some
// the alarms (ALM).
TEST(EslFrame, RepliesReportTheFlagsThatTheyCarry) {
  struct Row {
    DataId id;
    std::uint32_t status;
    std::uint32_t alarms;
  };
  for (const Row& row : {Row{DataId::position, 0xFFFF, 0xFFFF}, Row{DataId::singleturn, 0xFFFF, 0xFFFF},
                         Row{DataId::position_short, 0xFF, 0}, Row{DataId::singleturn_short, 0xFF, 0},
                         Row{DataId::calibration, 0xFFFF, 0}, Row{DataId::zero, 0xFFFF, 0xFFFF},
                         Row{DataId::clear_alarms, 0xFFFF, 0xFFFF}, Row{DataId::reset_multiturn, 0xFF, 0xFF},
                         Row{DataId::read_memory, 0, 0}}) {
    const Reading reading = to_reading({.id = row.id});
    EXPECT_EQ(reading.status_reported, row.status) << static_cast<int>(row.id);
    EXPECT_EQ(reading.alarms_reported, row.alarms) << static_cast<int>(row.id);
  }
}

// Table 5: if the alarm led_or_lissajous_error is raised and the status has only non_safety_error, the Lissajous
// signals cause the alarm.
TEST(EslFrame, LedAndLissajousErrorsCountForEveryId) {
  for (const auto& [error, validity] :
       {std::pair{status::safety_error, Validity::invalid}, std::pair{status::non_safety_error, Validity::valid}}) {
    for (const DataId id : {DataId::position, DataId::singleturn, DataId::position_short, DataId::singleturn_short,
                            DataId::calibration, DataId::zero, DataId::clear_alarms}) {
      Reply reply{.id = id};
      reply.one.status = static_cast<std::uint8_t>(status::ready | error);
      reply.two.status = static_cast<std::uint8_t>(status::channel_2 | status::ready | error);
      if (layout_of(id).has(part::alarms)) reply.one.alarms = reply.two.alarms = alarms::led_or_lissajous_error;
      EXPECT_EQ(to_reading(reply).singleturn_validity(), validity) << static_cast<int>(id);
      EXPECT_NE(to_reading(reply).multiturn_validity(), Validity::invalid) << static_cast<int>(id);
    }
  }
  // In these two cases the position is not valid: alarm and non_safety_error are in different channels, or one
  // channel's status has safety_error too.
  Reply reply = sample(DataId::position);
  reply.one = {.status = status::ready | status::non_safety_error};
  reply.two = {.status = status::channel_2 | status::ready, .alarms = alarms::led_or_lissajous_error};
  EXPECT_EQ(to_reading(reply).singleturn_validity(), Validity::invalid);
  reply.one = {.status = status::ready | status::non_safety_error | status::safety_error,
               .alarms = alarms::led_or_lissajous_error};
  reply.two = {.status = status::channel_2 | status::ready};
  EXPECT_EQ(to_reading(reply).singleturn_validity(), Validity::invalid);
}

// The request has a right checksum but a wrong parity bit; the encoder's reply reports the parity error.
TEST(EslUnit, AnswerToAWrongParityBitIsARefusal) {
  const Options values = author::testing::options_of(unit, "");
  const auto field = static_cast<std::uint8_t>(control_field({}, 0, DataId::position) ^ 0x80);
  const std::array<std::uint8_t, 2> request{field, checksum8(CrcBitOrder::lsb, std::array{field})};
  Reply reply = sample(DataId::position);
  reply.one.status = status::ready | status::parity_error;
  reply.two.status = status::ready | status::channel_2 | status::parity_error;
  NoFields nowhere;
  for (const Bytes asked : {Bytes(request), Bytes{}}) {
    const ReplyBytes refused = encode_reply({}, reply, field);
    EXPECT_EQ(unit.decode(values, {.bytes = asked}, {.bytes = refused}, nowhere), Error::request_rejected);
    const Explanation why = unit.explain(values, Error::request_rejected, {.bytes = asked}, {.bytes = refused});
    EXPECT_NE(why.detail.find("wrong parity bit"), std::string_view::npos) << why.detail;
  }
  // A reply that reports no parity error does not give request_rejected, although the request has a wrong parity bit.
  reply.one.status = status::ready;
  reply.two.status = status::ready | status::channel_2;
  const ReplyBytes taken = encode_reply({}, reply, field);
  EXPECT_EQ(unit.decode(values, {.bytes = request}, {.bytes = taken}, nowhere), Error::bad_checksum);
  EXPECT_EQ(unit.decode(values, {}, {.bytes = taken}, nowhere), Error::unexpected_reply);
}

TEST(EslUnit, ExplainsNothingWithoutAFrame) {
  EXPECT_EQ(decode_request({}, {}).error(), Error::wrong_length);
  const Options values = author::testing::options_of(unit, "");
  const Bytes request = hex<"0875">;
  EXPECT_EQ(unit.pause(values, {.bytes = request}), 0us);
  const RequestBytes page = encode_request({}, {.id = DataId::write_memory, .memory_address = page_select_address});
  EXPECT_EQ(unit.pause(values, {.bytes = page}), 18ms);
  EXPECT_EQ(unit.explain(values, Error::wrong_length, {.bytes = request}, {.bytes = request}).detail, "");
  for (unsigned byte = 0; byte < 256; ++byte) {
    const std::array reply{static_cast<std::uint8_t>(byte), std::uint8_t{0}, std::uint8_t{0}};
    if (data_id(reply[0])) continue;
    for (const Error error : {Error::bad_checksum, Error::unexpected_reply, Error::cross_check_failed}) {
      EXPECT_EQ(unit.explain(values, error, {}, {.bytes = reply}).detail, "") << byte;
    }
  }
}

}  // namespace
}  // namespace absenc::esl
