// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/e201/frame.hpp"

#include <gtest/gtest.h>

#include <string>

#include "absenc/protocol/e201/bench_test.hpp"
#include "absenc/protocol/e201/fields.hpp"

namespace absenc::e201 {
namespace {

Bytes bytes(std::string_view text) { return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}; }

Error error_of(std::string_view reply, const Format& format = testing::biss_format({.position = 19})) {
  return decode_position(format, bytes(reply)).error();
}

TEST(E201Frame, FailuresAreToldApart) {
  EXPECT_EQ(error_of("c0014328ff300000\r"), Error::none);
  EXPECT_EQ(error_of("C0014328FF300000\r"), Error::none);
  EXPECT_EQ(error_of("c0014328ff300000"), Error::wrong_length);
  EXPECT_EQ(error_of("c0014328ff300000\n"), Error::wrong_length);
  EXPECT_EQ(error_of("c0014328ff3000000\r"), Error::wrong_length);
  EXPECT_EQ(error_of("c0014328ff300000\r\n"), Error::wrong_length);
  EXPECT_EQ(error_of(""), Error::wrong_length);
  EXPECT_EQ(error_of("c0014328ff30000g\r"), Error::bad_framing);
  EXPECT_EQ(error_of("c0014328ff3000\r0\r"), Error::bad_framing);
  EXPECT_EQ(error_of("0000000000000000\r"), Error::line_stuck);
  EXPECT_EQ(error_of("ffffffffffffffff\r"), Error::line_stuck);
  EXPECT_EQ(error_of("80014328ff300000\r"), Error::bad_framing);  // 100
  EXPECT_EQ(error_of("40014328ff300000\r"), Error::bad_framing);  // 010
  EXPECT_EQ(error_of("e0014328ff300000\r"), Error::bad_framing);  // 111
  EXPECT_EQ(error_of("c000000000000000\r"), Error::bad_framing);  // no start bit
  EXPECT_EQ(error_of("c001c328ff300000\r"), Error::bad_framing);  // CDS
  EXPECT_EQ(error_of("c000000000000001\r"), Error::truncated);
  EXPECT_EQ(error_of("c000000000000002\r"), Error::truncated);
  EXPECT_EQ(error_of("c000000000000003\r"), Error::bad_framing);  // CDS, and truncated
  EXPECT_EQ(error_of("c0014328ff310000\r"), Error::none);         // behind the CRC
  EXPECT_EQ(error_of("c0014328fe300000\r"), Error::bad_checksum);
}

TEST(E201Frame, TheLongestAckThatFits) {
  for (unsigned bits = 1; bits <= 51; ++bits) {
    const Format format = testing::biss_format({.position = bits});
    const unsigned longest = 64 - 4 - (bits + 8);
    for (const unsigned ack : {1u, longest, longest + 1}) {
      BitBuffer<128> samples;
      ASSERT_TRUE(biss::encode(format.biss, {.ack_bits = ack, .word = {.position = low_mask(bits)}}, samples));
      while (samples.size() < 64) samples.append(0, 1);
      const ReplyText reply = encode_samples(samples.view().load(0, 64));
      const Result<Position> position = decode_position(format, reply);
      EXPECT_EQ(position.error(), ack > longest ? Error::truncated : Error::none) << bits << ' ' << ack;
      EXPECT_EQ(position.value_or({}).word.position, ack > longest ? 0 : low_mask(bits));
    }
  }
}

TEST(E201Frame, AnSsiWordFollowsTheFirstSample) {
  for (const ssi::AfterWord after : {ssi::AfterWord::repeat, ssi::AfterWord::zero, ssi::AfterWord::one}) {
    const Format format = testing::ssi_format(after);
    const Word word{.position = 0x1234, .multiturn = 0xABC};
    BitBuffer<64> samples;
    samples.append(1, 1);
    ASSERT_TRUE(ssi::encode(format.ssi, word, 63, samples));
    const std::uint64_t number = samples.view().load(0, 64);
    ASSERT_TRUE(decode_position(format, encode_samples(number)));
    EXPECT_EQ(decode_position(format, encode_samples(number))->word, word);
    EXPECT_EQ(decode_position(format, encode_samples(number ^ 1)).error(), Error::cross_check_failed);
    EXPECT_EQ(decode_position(format, encode_samples(number & ~(std::uint64_t{1} << 63))).error(), Error::bad_framing);
  }
}

TEST(E201Frame, RequestsAreWhatTheInterfaceReads) {
  const auto text = [](const RequestText& request) {
    return std::string(request.view().begin(), request.view().end());
  };
  EXPECT_EQ(text(encode_request('4')), "4");
  EXPECT_EQ(text(encode_request('M', 8)), "M8\r");
  EXPECT_EQ(text(encode_request('B', 26)), "B26\r");
  EXPECT_EQ(text(encode_request('B', 5)), "B05\r");
}

TEST(E201Frame, VersionsWhereverTheyStand) {
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

TEST(E201Frame, NumbersInTextsThatNobodyDescribes) {
  EXPECT_EQ(find_milli(bytes("4.98V 62mA"), 'V'), 4980u);
  EXPECT_EQ(find_milli(bytes("4.98V 62mA"), 'A'), 62u);
  EXPECT_EQ(find_milli(bytes("U = 5012 mV, I = 0.0625 A"), 'V'), 5012u);
  EXPECT_EQ(find_milli(bytes("U = 5012 mV, I = 0.0625 A"), 'A'), 62u);
  EXPECT_EQ(find_milli(bytes("5"), 'V'), std::nullopt);
  EXPECT_EQ(find_clock(bytes("5\r")), 5u);
  EXPECT_EQ(find_clock(bytes("M3")), 3u);
  EXPECT_EQ(find_clock(bytes("1100 kHz")), 6u);
  EXPECT_EQ(find_clock(bytes("9")), std::nullopt);
  EXPECT_EQ(find_clock(bytes("M")), std::nullopt);
  EXPECT_EQ(decode_number(bytes("-17\r"), 10).value(), -17);
  EXPECT_EQ(decode_number(bytes(" 0ff \r"), 16).value(), 255);
  EXPECT_EQ(decode_number(bytes("ffffffffffffffff"), 16).value(), -1);
  for (const std::string_view words : {"", "-", "ff", "1 2", "18446744073709551616"}) {
    EXPECT_EQ(decode_number(bytes(words), 10).error(), Error::bad_framing) << words;
  }
}

Error decode_text(std::string_view request, std::string_view reply) {
  struct Counting final : FieldSink {
    void put(const FieldValue&) override { ++count; }
    unsigned count = 0;
  } sink;
  const Error error = decode(testing::biss_format(), bytes(request), bytes(reply), sink);
  EXPECT_EQ(error == Error::none, sink.count > 0);
  return error;
}

TEST(E201Frame, RepliesToTheOtherCommands) {
  for (const std::string_view request : {"v", "s", "e"}) {
    EXPECT_EQ(decode_text(request, "anything 1\r"), Error::none);
    EXPECT_EQ(decode_text(request, "anything 1"), Error::wrong_length);
    EXPECT_EQ(decode_text(request, "\r"), Error::wrong_length);
    EXPECT_EQ(decode_text(request, "any\001thing\r"), Error::bad_framing);
  }
  EXPECT_EQ(decode_text("m", "5\r"), Error::none);
  EXPECT_EQ(decode_text("m", "9\r"), Error::bad_framing);
  EXPECT_EQ(decode_text("b", "26\r"), Error::none);
  EXPECT_EQ(decode_text("?", "-5\r"), Error::none);
  EXPECT_EQ(decode_text(">", "1f\r"), Error::none);
  EXPECT_EQ(decode_text("?", "1f\r"), Error::bad_framing);
  EXPECT_EQ(decode_text("z", "ok\r"), Error::unsupported);
  EXPECT_EQ(decode_text("q", "ok\r"), Error::unsupported);
  EXPECT_EQ(decode_text("M5\r", ""), Error::none);
  EXPECT_EQ(decode_text("", ""), Error::wrong_length);
}

}  // namespace
}  // namespace absenc::e201
