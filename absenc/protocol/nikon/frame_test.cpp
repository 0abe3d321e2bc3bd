// SPDX-License-Identifier: Apache-2.0
// Tests of the frames of Nikon's A-format.
#include "absenc/protocol/nikon/frame.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "absenc/protocol/nikon/protocol.hpp"

namespace absenc::nikon {
namespace {

using Wire = std::vector<std::uint8_t>;

Wire wire(const auto& bytes) { return {bytes.view().begin(), bytes.view().end()}; }

// Returns all command codes that a source lists.
std::vector<Code> all_codes() {
  std::vector<Code> codes;
  for (unsigned number = 0; number < 64; ++number) {
    if (const std::optional<Code> code = code_of(number)) codes.push_back(*code);
  }
  return codes;
}

TEST(NikonFrame, CodesAreThoseThatSourcesList) {
  EXPECT_EQ(all_codes().size(), 27u);
  for (const unsigned number : {23u, 26u, 31u, 32u, 63u}) EXPECT_FALSE(code_of(number)) << number;
}

// Positions with the checksums that the README of HPMicro's hpm_sdk prints; the highest bit is sent first.
TEST(NikonFrame, ChecksumsAreThoseThatAnotherVendorPrints) {
  for (const auto& [singleturn, printed] :
       {std::pair{0xFFFA6u, 0x7Au}, std::pair{0xFFFA7u, 0x59u}, std::pair{0xFFFA8u, 0xCAu}, std::pair{0xFFFA9u, 0xE9u},
        std::pair{0xFFFAAu, 0x55u}, std::pair{0xFFFABu, 0x76u}, std::pair{0xFFFACu, 0x0Bu}}) {
    const OneReply reply{.data = singleturn | std::uint64_t{0x8888} << 20};
    const OneReplyBytes bytes = encode_reply(Code::position, reply);
    EXPECT_EQ(reflect(bytes[7], 8), printed);
    const Result<Reply> decoded = decode_reply({}, {}, bytes);
    ASSERT_EQ(decoded.error(), Error::none);
    EXPECT_EQ(singleturn_in({}, Code::position, decoded->data), singleturn);
    EXPECT_EQ(multiturn_in({}, Code::position, decoded->data), 0x8888u);
  }
  // The first line that the README prints has a checksum that fits only if the first frame of the reply (two bytes) is
  // 0.
  const Wire first{0x00, 0x00, 0xA5, 0xFF, 0x8F, 0x88, 0x08};
  EXPECT_EQ(reflect(checksum(first), 8), 0xA9u);
}

TEST(NikonFrame, RequestsDecodeToWhatWasEncoded) {
  for (const Code code : all_codes()) {
    for (const BitOrder order : {BitOrder::low_first, BitOrder::high_first}) {
      const Format format{.bit_order = order};
      Request request{.code = code, .address = 5};
      if (is_memory_access(code)) request.word = 0xA7;
      if (code == Code::write_memory) request.value = 0x1234;
      if (sends_identity(code)) request.value = 0x123456;
      const RequestBytes bytes = encode_request(format, request);
      EXPECT_EQ(bytes.size(), 2 * frames_of(code));
      EXPECT_EQ(Protocol::request_size(format, bytes), bytes.size());
      EXPECT_EQ(Protocol::request_size(format, bytes.view().first(1)), 2u);
      const Result<Request> decoded = decode_request(format, bytes);
      ASSERT_EQ(decoded.error(), Error::none);
      EXPECT_EQ(decoded->code, request.code);
      EXPECT_EQ(decoded->address, request.address);
      EXPECT_EQ(decoded->word, request.word);
      EXPECT_EQ(decoded->value, request.value);
    }
  }
}

TEST(NikonFrame, RefusesBadRequests) {
  const auto error = [](const Wire& bytes) { return decode_request({}, bytes).error(); };
  EXPECT_EQ(error({}), Error::wrong_length);
  EXPECT_EQ(error({0x02}), Error::wrong_length);
  EXPECT_EQ(error({0x04, 0x00, 0x00}), Error::wrong_length) << "the length is checked before the sync code";
  EXPECT_EQ(error({0x02, 0x00, 0x5A}), Error::wrong_length);
  EXPECT_EQ(error({0x02, 0x00, 0x5A, 0x02}), Error::wrong_length);
  EXPECT_EQ(error({0x04, 0x00}), Error::bad_framing);
  EXPECT_EQ(error({0x02, 0x20}), Error::bad_checksum);
  EXPECT_EQ(error({0x5A, 0x02}), Error::bad_framing) << "begins with MDF2";
  EXPECT_EQ(error({0x02, 0x0D}), Error::wrong_length) << "a word is to be read, and MDF2 is missing";
  EXPECT_EQ(error({0x02, 0x0D, 0x5B, 0x02}), Error::bad_framing);
  EXPECT_EQ(error({0x02, 0x0D, 0x8A, 0x67}), Error::bad_framing) << "MDF0 instead of MDF2";
  EXPECT_EQ(error({0x02, 0x0D, 0x5A, 0x22}), Error::bad_checksum);
  const auto size = [](const Wire& bytes) { return Protocol::request_size({}, bytes); };
  EXPECT_EQ(size({0x02, 0x20}), 0u);
  EXPECT_EQ(size({0x02, 0x17}), 0u) << "a code that no source lists";
}

TEST(NikonFrame, RepliesDecodeToWhatWasEncoded) {
  for (const Code code : all_codes()) {
    const bool is_short = data_bits(code) == 17;
    const OneReply reply{.address = 5, .status = std::uint8_t(is_short ? 1 : 9), .data = 0x155};
    const OneReplyBytes bytes = encode_reply(code, reply);
    EXPECT_EQ(bytes.size(), reply_length(code));
    const Result<Reply> decoded = decode_reply({}, {.code = code, .address = 5}, bytes);
    ASSERT_EQ(decoded.error(), Error::none) << unsigned(code);
    EXPECT_EQ(decoded->count, 1u);
    EXPECT_EQ(decoded->address, 5);
    EXPECT_EQ(decoded->status, reply.status);
    EXPECT_EQ(decoded->data, reply.data);
    EXPECT_EQ(decode_reply({}, {.code = code, .address = 5}, bytes.view().first(1)).error(), Error::wrong_length);
    // A reply without its request shows its command code; the replies that do not (codes 21 and 22) are recognized by
    // their length.
    const Result<Request> shown = request_of_reply(bytes);
    ASSERT_EQ(shown.error(), Error::none);
    EXPECT_EQ(shown->code, is_short ? Code::short_position : code);
    EXPECT_EQ(shown->address, 5);
    if (!is_short) {
      EXPECT_EQ(reply_size(bytes), bytes.size());
    }
  }
}

TEST(NikonFrame, ShortRepliesAreRecognizedByBitsThatNoOtherReplyHas) {
  const auto size = [](std::uint64_t data) { return reply_size(encode_reply(Code::short_position, {.data = data})); };
  EXPECT_EQ(size(0x1FFFF), 4u);
  EXPECT_EQ(size(0x10), 4u) << "the fixed bit is set";
  EXPECT_EQ(size(0x01), 6u) << "a reply to CC 2 may begin so";
  EXPECT_EQ(reply_size(encode_reply(Code::short_position, {.status = 1, .data = 0x0F})), 4u) << "no reply has CC 31";
  EXPECT_EQ(reply_size(Wire{0x04}), 2u);
  EXPECT_EQ(reply_size(Wire{0x02, 0x00}), 0u) << "other first bits";
  EXPECT_EQ(request_of_reply(Wire{0x04, 0x00, 0x00}).error(), Error::wrong_length);
  EXPECT_EQ(request_of_reply(Wire{0xC4, 0x07, 0, 0, 0, 0}).error(), Error::unexpected_reply);
}

TEST(NikonFrame, RepliesOfALineRiseInAddress) {
  const auto answered = [](std::initializer_list<int> addresses) {
    Wire all;
    for (const int address : addresses) {
      const Wire one = wire(encode_reply(Code::all_positions, {.address = static_cast<std::uint8_t>(address)}));
      all.insert(all.end(), one.begin(), one.end());
    }
    return decode_reply({}, {.code = Code::all_positions}, all);
  };
  EXPECT_EQ(answered({0, 1, 2, 3, 4, 5, 6, 7})->count, 8u);
  EXPECT_EQ(answered({1, 4})->at(1).address, 4);
  EXPECT_EQ(answered({4, 1}).error(), Error::unexpected_reply);
  EXPECT_EQ(answered({3, 3}).error(), Error::unexpected_reply);
  EXPECT_EQ(answered({0, 1, 2, 3, 4, 5, 6, 7, 7}).error(), Error::wrong_length);
  EXPECT_EQ(answered({}).error(), Error::wrong_length);
  const Wire one = wire(encode_reply(Code::position, {}));
  Wire twice = one;
  twice.insert(twice.end(), one.begin(), one.end());
  EXPECT_EQ(decode_reply({}, {}, twice).error(), Error::wrong_length) << "one encoder was asked";
}

TEST(NikonFrame, OnlyEncoderOfALineAnswersWithItsOwnAddress) {
  for (const Code code :
       {Code::set_address, Code::read_only_identity, Code::write_only_identity, Code::assign_address}) {
    EXPECT_TRUE(decode_reply({}, {.code = code}, encode_reply(code, {.address = 5})));
  }
  EXPECT_EQ(decode_reply({}, {.code = Code::read_identity}, encode_reply(Code::read_identity, {.address = 5})).error(),
            Error::unexpected_reply);
}

TEST(NikonFrame, BitsAboveTheNumbersAreRefused) {
  const auto error = [](const Format& format, Code code, unsigned bit) {
    const OneReply reply{.data = std::uint64_t{1} << bit};
    return decode_reply(format, {.code = code}, encode_reply(code, reply)).error();
  };
  const auto ends_at = [&](const Format& format, Code code, unsigned bits) {
    EXPECT_EQ(error(format, code, bits - 1), Error::none) << unsigned(code);
    EXPECT_EQ(error(format, code, bits), Error::out_of_range) << unsigned(code);
  };
  ends_at({}, Code::position, 36);
  ends_at({}, Code::upper, 20);
  ends_at({.multiturn_bits = 2}, Code::lower, 22);
  ends_at({.multiturn_bits = 0}, Code::with_alarms, 20);
  ends_at({.multiturn_bits = 0}, Code::with_temperature, 20);
  ends_at({}, Code::alarms, 16);
  ends_at({}, Code::clear_alarms, 16);
  EXPECT_EQ(error({}, Code::lower, 23), Error::none) << "turns";
  EXPECT_EQ(error({}, Code::temperature, 23), Error::none);
}

// ---- Readings

TEST(NikonReading, Parts) {
  const std::uint64_t data = 0x12345 | std::uint64_t{0xABCD} << 20;
  EXPECT_EQ(multiturn_in({}, Code::upper, data >> 16), 0xABCDu);
  EXPECT_EQ(multiturn_in({}, Code::lower, data), std::nullopt);
  EXPECT_EQ(multiturn_in({.multiturn_bits = 0}, Code::position, data), std::nullopt);
  EXPECT_EQ(singleturn_in({}, Code::all_with_temperature, data), 0x12345u);
  EXPECT_EQ(singleturn_in({}, Code::upper, data), std::nullopt);
  EXPECT_EQ(singleturn_in({}, Code::short_position, 5), std::nullopt) << "not all bits";
  EXPECT_EQ(singleturn_in({.singleturn_bits = 17}, Code::short_position, 5), 5u);
  const Reading reading = to_reading({}, Code::position, {.data = data});
  EXPECT_EQ(reading.singleturn, 0x12345u);
  EXPECT_EQ(reading.multiturn, 0xABCDu);
}

TEST(NikonReading, StatusOfZeroReportsNoAlarm) {
  const Reading good = to_reading({}, Code::position, {.data = 5});
  EXPECT_EQ(good.alarms_reported, alarm::all);
  EXPECT_EQ(good.singleturn_validity(), Validity::valid);
  EXPECT_EQ(good.multiturn_validity(), Validity::valid);
  const Reading open = to_reading({}, Code::position, {.status = 8, .data = 5});
  EXPECT_EQ(open.alarms_reported, 0u);
  EXPECT_EQ(open.singleturn_validity(), Validity::unknown);
  EXPECT_EQ(open.multiturn_validity(), Validity::unknown);
}

TEST(NikonReading, AlarmsMakePartsInvalid) {
  const auto reading = [](std::uint64_t alarms) {
    return to_reading({}, Code::with_alarms, {.status = 1, .data = alarms << 24});
  };
  EXPECT_EQ(reading(alarm::battery | alarm::overflow | alarm::memory_busy).singleturn_validity(), Validity::valid);
  EXPECT_EQ(reading(alarm::all).alarms, alarm::all);
  for (unsigned bit = 0; bit < 11; ++bit) {
    const auto alarm = static_cast<std::uint16_t>(1u << bit);
    Reading judged = to_reading({}, Code::position, {});
    judge(judged, alarm);
    const bool position_holds = bit <= 2 || bit == 4 || bit == 8 || bit == 9;
    EXPECT_EQ(judged.singleturn_valid(), position_holds) << bit;
    EXPECT_EQ(judged.singleturn_valid(), reading(alarm).singleturn_valid()) << bit;
    EXPECT_EQ(judged.multiturn_valid, (position_holds && bit != 1) || bit == 5 || bit == 10) << bit;
  }
  EXPECT_EQ(to_reading({}, Code::alarms, {.data = 0xFFFF}).alarms, alarm::all);
}

TEST(NikonReading, EarlierAlarmsExplainAStatus) {
  const Reading open = to_reading({}, Code::position, {.status = 1});
  const Reading lost = to_reading({}, Code::alarms, {.status = 1, .data = alarm::singleturn_error});
  EXPECT_EQ(remembered({}, open).singleturn_validity(), Validity::unknown);
  EXPECT_EQ(remembered(to_reading({}, Code::position, {}), open).singleturn_validity(), Validity::unknown)
      << "an alarm is new";
  EXPECT_EQ(remembered(lost, open).alarms, alarm::singleturn_error);
  EXPECT_EQ(remembered(lost, open).singleturn_validity(), Validity::invalid);
  EXPECT_EQ(remembered(lost, open).multiturn_validity(), Validity::valid);
  EXPECT_EQ(remembered(lost, to_reading({}, Code::position, {})).alarms, 0u);
}

}  // namespace
}  // namespace absenc::nikon
