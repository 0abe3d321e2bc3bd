// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/reply.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "absenc/core/hex.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::esl {
namespace {

constexpr std::array all_ids{DataId::position,         DataId::singleturn,      DataId::position_short,
                             DataId::singleturn_short, DataId::calibration,     DataId::encoder_id,
                             DataId::temperature,      DataId::alarms,          DataId::zero,
                             DataId::clear_alarms,     DataId::reset_multiturn, DataId::read_memory,
                             DataId::write_memory};

constexpr std::array<std::uint8_t, 9> check_input{'1', '2', '3', '4', '5', '6', '7', '8', '9'};

// Every profile that changes frames.
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

Reply sample(DataId id, std::uint8_t address) {
  Reply reply{.id = id, .encoder_address = address};
  const Layout& layout = layout_of(id);
  if (is_memory_access(id)) {
    reply.memory_address = 0x55;
    reply.value = 0xA7;
    return reply;
  }
  reply.one.status = status::ready | status::non_safety_error;
  reply.two.status = status::ready | status::channel_2 | status::temperature_warning;
  if (layout.has(part::alarms)) {
    reply.one.alarms = alarms::overspeed;
    reply.two.alarms = alarms::xc_error | alarms::over_voltage;
  }
  if (layout.has(part::singleturn)) reply.singleturn = 0xABCDEF;
  if (layout.has(part::multiturn)) reply.multiturn = 0xFEDC;
  if (layout.has(part::temperature)) reply.temperature = -10;
  if (layout.has(part::sequence)) {
    reply.one.sequence = 0xD5;
    reply.two.sequence = 0x55;
  }
  if (layout.has(part::encoder_id)) reply.one.encoder_id = reply.two.encoder_id = 0xD8;
  if (layout.has_two() && layout.has(part::singleturn)) reply.redundant = 0xABCDEF >> 15;
  return reply;
}

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
    const auto id = static_cast<std::uint8_t>(field >> 3 & 0xF);
    unsigned ones_of_id = 0;
    unsigned ones_of_all = 0;
    for (unsigned bit = 0; bit < 8; ++bit) {
      if (bit >= 3) ones_of_id += field >> bit & 1;
      ones_of_all += field >> bit & 1;
    }
    EXPECT_EQ(control_field({}, field & 7, id) == field, ones_of_id % 2 == 1) << field;
    EXPECT_EQ(control_field({.parity_scope = ParityScope::all}, field & 7, id) == field, ones_of_all % 2 == 1) << field;
  }
}

// Table 5 in either order: DD, EA and CA from b0 up in T-format.
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
  for (unsigned value = 0; value < 256; ++value) {
    unsigned wire = 0;
    for (const auto& [bit, place] : places) wire |= (value & bit) != 0 ? place : 0u;
    const auto byte = static_cast<std::uint8_t>(value);
    EXPECT_EQ(detail::status_to_wire(tformat, byte), wire);
    EXPECT_EQ(detail::status_from_wire(tformat, static_cast<std::uint8_t>(wire)), value);
    EXPECT_EQ(detail::status_to_wire({}, byte), value);
    EXPECT_EQ(detail::status_from_wire({}, byte), value);
  }
}

TEST(EslFrame, RequestsComeBackInEveryProfile) {
  for (const Profile& profile : all_profiles()) {
    for (const DataId id : all_ids) {
      for (std::uint8_t address = 0; address < 8; ++address) {
        Request request{id, address};
        if (is_memory_access(id)) request.memory_address = 0x5A;
        if (id == DataId::write_memory) request.value = 0xC3;
        const RequestBytes bytes = encode_request(profile, request);
        ASSERT_EQ(bytes.size(), request_length(profile, id));
        const Result<Request> back = decode_request(profile, bytes);
        ASSERT_TRUE(back.has_value());
        EXPECT_EQ(back->id, id);
        EXPECT_EQ(back->encoder_address, address);
        EXPECT_EQ(back->memory_address, request.memory_address);
        EXPECT_EQ(back->value, request.value);
      }
    }
  }
}

TEST(EslFrame, RepliesComeBackInEveryProfile) {
  for (const Profile& profile : all_profiles()) {
    for (const DataId id : all_ids) {
      Reply reply = sample(id, 3);
      if (id == DataId::calibration && profile.id6_rs == Id6Redundant::bits_16) reply.redundant = 0xABCD;
      const ReplyBytes bytes = encode_reply(profile, reply);
      ASSERT_EQ(bytes.size(), reply_length(id));
      const Result<Reply> back = decode_reply(profile, {id, 3, 0x55, 0xA7}, bytes);
      ASSERT_TRUE(back.has_value()) << static_cast<int>(id) << text_of(back.error()).name;
      EXPECT_EQ(back->one.status, is_memory_access(id) ? 0 : reply.one.status);
      EXPECT_EQ(back->two.status, reply.two.status & (layout_of(id).has_two() ? 0xFF : status::channel_2));
      EXPECT_EQ(back->one.alarms, reply.one.alarms);
      EXPECT_EQ(back->singleturn, reply.singleturn);
      EXPECT_EQ(back->multiturn, reply.multiturn);
      EXPECT_EQ(back->redundant, reply.redundant);
      EXPECT_EQ(back->one.sequence, reply.one.sequence);
      EXPECT_EQ(back->temperature, reply.temperature);
      EXPECT_EQ(back->memory_address, reply.memory_address);
      EXPECT_EQ(back->value, reply.value);
    }
  }
}

TEST(EslFrame, EveryRequestBitFlipIsSeen) {
  for (const DataId id : all_ids) {
    const RequestBytes good = encode_request({}, {id, 5, 0x2A, 0x91});
    for (unsigned bit = 0; bit < good.size() * 8; ++bit) {
      RequestBytes bad = good;
      bad[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
      EXPECT_FALSE(decode_request({}, bad).has_value()) << static_cast<int>(id) << " " << bit;
    }
  }
}

TEST(EslFrame, WhichChannelIsWrongIsNamed) {
  const ReplyBytes good = encode_reply({}, sample(DataId::position, 0));
  const Request request{};
  const auto checked = [&request](Bytes bytes) {
    Reply reply;
    return check_reply(Profile{}, request, bytes, reply);
  };
  EXPECT_EQ(checked(good), Check::passed);
  ReplyBytes bad = good;
  bad[4] ^= 1;
  EXPECT_EQ(checked(bad), Check::ch1_checksum);
  bad[14] ^= 1;
  EXPECT_EQ(checked(bad), Check::both_checksums);
  bad[4] ^= 1;
  EXPECT_EQ(checked(bad), Check::ch2_checksum);
  EXPECT_EQ(checked(good.view().first(11)), Check::channel_2_missing);
  EXPECT_EQ(checked(bad.view().first(12)), Check::length);
  ReplyBytes swapped;
  swapped.append(good.view().subspan(11));
  swapped.append(good.view().first(11));
  EXPECT_EQ(checked(swapped), Check::channels_swapped);
  EXPECT_EQ(checked(encode_reply({}, sample(DataId::position, 2))), Check::other_address);
  EXPECT_EQ(checked(encode_reply({}, sample(DataId::position, 2)).view()), Check::other_address);
  EXPECT_EQ(decode_reply({}, {DataId::singleturn}, encode_reply({}, sample(DataId::zero, 0))).error(),
            Error::unexpected_reply);
}

TEST(EslFrame, EveryCheckHasItsSentence) {
  for (std::size_t i = 1; i < check_texts.size(); ++i) {
    EXPECT_NE(check_texts[i].error, Error::none) << i;
    EXPECT_FALSE(check_texts[i].sentence.empty()) << i;
    for (std::size_t other = 1; other < i; ++other) EXPECT_NE(check_texts[i].sentence, check_texts[other].sentence);
  }
}

// Which status and alarm bits take what of a reading away.
TEST(EslFrame, ValidityOfEachPart) {
  Reply reply = sample(DataId::position, 0);
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
  EXPECT_FALSE(to_reading(short_reply).multiturn_valid);
  EXPECT_EQ(to_reading({.id = DataId::temperature}).singleturn_bits, 0u);
}

}  // namespace
}  // namespace absenc::esl
