// SPDX-License-Identifier: Apache-2.0
// Tests of frames and texts that the test vectors do not cover.
#include "absenc/protocol/e201/frame.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace absenc::e201 {
namespace {

Bytes bytes(std::string_view text) { return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}; }

std::string name(Error error) { return std::string(text_of(error).name); }

Result<Reply> decode(std::uint8_t letter, std::string_view reply, const Format& format = {}) {
  return Protocol::decode(format, {letter}, bytes(reply));
}

Format ssi_format(const WordFormat& word, ssi::AfterWord after = ssi::AfterWord::repeat) {
  return {.word = word, .carries = Carries::ssi, .after_word = after};
}

WordFormat position_of(unsigned bits) { return biss::word_with_status({.position = bits}); }

TEST(E201Frame, DistinguishesErrorsOfSamples) {
  for (const auto& [reply, error] : std::to_array<std::pair<std::string_view, Error>>({
           {"c0014328ff300000\n", Error::wrong_length},    // a reply that ends with LF instead of CR
           {"c0014328ff3000000\r", Error::wrong_length},   // a reply with one digit too many
           {"c0014328ff300000\r\n", Error::wrong_length},  // a reply with an LF after the CR
           {"c0014328ff3000\r0\r", Error::bad_framing},    // a reply with a CR among its digits
           {"80014328ff300000\r", Error::bad_framing},     // the bits of the frame begin with 1 0 0 instead of 1 1 0
           {"c000000000000002\r", Error::truncated},       // the CDS bit is the last sample
           {"c000000000000003\r", Error::bad_framing},     // CDS is 1, and the frame is truncated
           {"c0014328ff310000\r", Error::none},            // a sample behind the CRC is flipped, which is no error
           {"c0014328fe300000\r", Error::bad_checksum},
       })) {
    EXPECT_EQ(name(decode('4', reply).error()), name(error)) << reply;
  }
}

TEST(E201Frame, DecodesLongestAckThatFits) {
  for (unsigned bits = 1; bits <= 51; ++bits) {
    const Format format{.word = position_of(bits)};
    const unsigned longest = 64 - 4 - (bits + 8);
    for (const unsigned ack : {1u, longest, longest + 1}) {
      BitBuffer<128> samples;
      ASSERT_TRUE(biss::encode(format.biss(), {.ack_bits = ack, .word = {.position = low_mask(bits)}}, samples));
      while (samples.size() < 64) samples.append(0, 1);
      const Result<Position> position = decode_position(format, samples.view().load(0, 64));
      EXPECT_EQ(name(position.error()), name(ack > longest ? Error::truncated : Error::none)) << bits << ' ' << ack;
      EXPECT_EQ(position.value_or({}).word.position, ack > longest ? 0 : low_mask(bits));
    }
  }
}

TEST(E201Frame, AcceptsWidestWordThatFits) {
  EXPECT_TRUE(fits({.word = position_of(51)}));
  EXPECT_FALSE(fits({.word = position_of(52)}));
  EXPECT_TRUE(fits(ssi_format("position:63"_word)));
  EXPECT_FALSE(fits(ssi_format("position:63 error:1"_word)));
  EXPECT_FALSE(fits({.word = WordFormat{}}));
  EXPECT_EQ(name(decode('4', "0000000000000000\r", {.word = position_of(52)}).error()), "invalid_argument");
}

TEST(E201Frame, DecodesSsiWordAfterFirstSample) {
  for (const ssi::AfterWord after : {ssi::AfterWord::repeat, ssi::AfterWord::zero, ssi::AfterWord::one}) {
    const Format format = ssi_format("multiturn:12 position:13 gray"_word, after);
    const Word word{.position = 0x1234, .multiturn = 0xABC};
    BitBuffer<64> samples;
    samples.append(1, 1);
    ASSERT_TRUE(ssi::encode(format.ssi(), word, 63, samples));
    const std::uint64_t number = samples.view().load(0, 64);
    ASSERT_TRUE(decode_position(format, number));
    EXPECT_EQ(decode_position(format, number)->word, word);
    EXPECT_EQ(name(decode_position(format, number ^ 1).error()), "cross_check_failed");
    EXPECT_EQ(name(decode_position(format, number & ~(std::uint64_t{1} << 63)).error()), "bad_framing");
  }
}

TEST(E201Frame, EncodesAndDecodesRequests) {
  for (const auto& [request, text] : std::to_array<std::pair<Request, std::string_view>>(
           {{{'4'}, "4"}, {{'M', 1}, "M1\r"}, {{'M', 8}, "M8\r"}, {{'M', 0}, ""}, {{'M', 9}, ""}, {{'b'}, "b"}})) {
    const ByteBuffer<4> encoded = Protocol::encode({}, request);
    EXPECT_EQ(std::string(encoded.view().begin(), encoded.view().end()), text);
    if (text.empty()) continue;
    EXPECT_EQ(Protocol::request_size({}, bytes(text)), text.size());
    const Result<Request> decoded = Protocol::decode_request({}, encoded);
    ASSERT_TRUE(decoded) << text;
    EXPECT_EQ(decoded->letter, request.letter);
    EXPECT_EQ(decoded->clock, request.clock);
  }
  EXPECT_EQ(Protocol::decode_request({}, bytes("M5")).value().clock, 5u);  // a command may end without its CR
  for (const auto& [text, error] :
       std::to_array<std::pair<std::string_view, std::string_view>>({{"", "wrong_length"},
                                                                     {"q", "unsupported"},
                                                                     {"44", "wrong_length"},
                                                                     {"M\r", "wrong_length"},
                                                                     {"M44", "wrong_length"},
                                                                     {"Mx", "wrong_length"},
                                                                     {"M0", "unsupported"},
                                                                     {"M9", "unsupported"},
                                                                     {"B7", "wrong_length"},
                                                                     {"B65", "unsupported"},
                                                                     {"B00", "unsupported"}})) {
    EXPECT_EQ(name(Protocol::decode_request({}, bytes(text)).error()), error) << text;
  }
  EXPECT_EQ(Protocol::decode_request({}, bytes("B26\r")).value().width, 26u);
  for (const char* text : {">", "1"}) EXPECT_TRUE(Protocol::decode_request({}, bytes(text))) << text;
  EXPECT_EQ(decode_line(letter::hexadecimal, bytes("000100001\r")).value().number, 0x100001);
  EXPECT_EQ(find_milli(bytes("5,02V 0,033A"), 'V'), 5020u);
  EXPECT_EQ(find_milli(bytes("5,02V 0,033A"), 'A'), 33u);
  EXPECT_EQ(find_milli(bytes("5V, 33mA"), 'A'), 33u);
  EXPECT_EQ(Protocol::request_size({}, bytes("q")), 0u);
}

TEST(E201Frame, DecodesReplyLines) {
  const std::string longest(64, 'x');
  for (const auto& [letter, reply, error] : std::to_array<std::tuple<char, std::string, std::string_view>>(
           {{'v', "anything 1\r", "none"},
            // A reply that begins with the LF of the previous line, and ends with an LF.
            {'s', "\n anything ~\r\n", "none"},
            {'e', longest + "\r", "none"},
            {'e', longest + "x\r", "wrong_length"},
            {'v', "anything 1", "wrong_length"},
            {'v', " \r", "wrong_length"},
            {'v', "one\rtwo", "wrong_length"},
            {'v', "any\001thing\r", "bad_framing"},
            {'v', "any\177thing\r", "bad_framing"},
            {'m', "5\r", "none"},
            {'m', "9\r", "bad_framing"},
            {'b', "26\r", "none"},
            {'b', "none\r", "bad_framing"},
            {'?', "-5\r", "none"},
            {'?', "1f\r", "bad_framing"},
            {'z', "ok\r", "unsupported"}})) {
    EXPECT_EQ(name(decode(static_cast<std::uint8_t>(letter), reply).error()), error) << letter << reply;
  }
  const Text text = decode('s', "\n anything ~\r\n")->text;
  EXPECT_EQ(std::string(text.view().begin(), text.view().end()), "anything ~");
  EXPECT_EQ(Protocol::expected({}, {'v'}, bytes("5\rx")), 2u);
  EXPECT_EQ(Protocol::expected({}, {'v'}, bytes("5")), 0u);
  EXPECT_EQ(Protocol::expected({}, {'z'}, bytes("5\r")), 0u);
}

TEST(E201Frame, FindsVersionAnywhereInText) {
  for (const auto& [words, major, minor] : std::to_array<std::tuple<std::string_view, unsigned, unsigned>>(
           {{"1.16\r", 1, 16}, {"E201-9S V1.16 \r", 1, 16}, {"E201-9S v 2.3.4", 2, 3}, {"rev 10 1.09 b", 1, 9}})) {
    const std::optional<Version> version = find_version(bytes(words));
    ASSERT_TRUE(version) << words;
    EXPECT_EQ(version->major, major) << words;
    EXPECT_EQ(version->minor, minor) << words;
  }
  for (const std::string_view words : {"", "E201-9S", "1.", ".5", "1. 6"}) EXPECT_FALSE(find_version(bytes(words)));
  EXPECT_TRUE(has_samples({1, 16}) && has_samples({2, 0}) && has_samples({1, 17}));
  EXPECT_FALSE(has_samples({1, 15}) || has_samples({1, 2}) || has_samples({0, 99}));
}

TEST(E201Frame, FindsNumbersInUndocumentedTexts) {
  EXPECT_EQ(find_milli(bytes("4.98V 62mA"), 'V'), 4980u);
  EXPECT_EQ(find_milli(bytes("5000000 V"), 'V'), ~0u) << "more than the number holds";
  EXPECT_EQ(find_milli(bytes("4.98V 62mA"), 'A'), 62u);
  EXPECT_EQ(find_milli(bytes("U = 5012 mV, I = 0.0625 A"), 'V'), 5012u);
  EXPECT_EQ(find_milli(bytes("U = 5012 mV, I = 0.0625 A"), 'A'), 62u);
  EXPECT_EQ(find_milli(bytes("5"), 'V'), std::nullopt);
  EXPECT_EQ(find_milli(bytes("5 m"), 'V'), std::nullopt);
  for (const auto& [words, clock] : std::to_array<std::pair<std::string_view, std::int64_t>>(
           {{"5", 5}, {"M3", 3}, {"1", 1}, {"8", 8}, {"1100 kHz", 6}, {"35", 1}, {"4400", 8}, {"9", 0}, {"0", 0}})) {
    EXPECT_EQ(find_clock(bytes(words)).value_or(0), clock) << words;
  }
  // of a number with more than nine digits only the first nine are used
  EXPECT_EQ(find_number(bytes("B1234567890")).value(), 123'456'789);
  EXPECT_EQ(decode_number(bytes("-17")).value(), -17);
  EXPECT_EQ(decode_number(bytes("+17")).value(), 17);
  EXPECT_EQ(decode_number(bytes("-9223372036854775808")).value(), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(decode_number(bytes("18446744073709551615")).value(), -1);
  for (const std::string_view words : {"", "-", "--1", "ff", "1 2", "18446744073709551616", "000000000000000000001"}) {
    EXPECT_EQ(name(decode_number(bytes(words)).error()), "bad_framing") << words;
  }
}

}  // namespace
}  // namespace absenc::e201
