// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/endat/frame.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <optional>
#include <utility>
#include <vector>

#include "absenc/protocol/endat/alarm_follower.hpp"
#include "absenc/protocol/endat/protocol.hpp"
#include "absenc/protocol/endat/reading.hpp"

namespace absenc::endat {
namespace {

// The checksums that README.md lists, of "Printed by others" and of the computed ones.
TEST(EndatFrame, ChecksumsAreThoseOfTheSources) {
  const auto of_24_bits = [](std::uint32_t value) {
    BitBuffer<24> bits;
    bits.append(value, 24);
    return crc_of_bits(bits.view(), 0, 24);
  };
  EXPECT_EQ(of_24_bits(0xA10000), 0x1C);
  EXPECT_EQ(of_24_bits(0x0D800D), 0x15);
  EXPECT_EQ(of_24_bits(0x642710), 0x1E);
  EXPECT_EQ(of_24_bits(0x000000), 0x18);
  EXPECT_EQ(of_24_bits(0xB90000), 0x13);
  EXPECT_EQ(of_24_bits(0xFFFFFF), 0x12);
  EXPECT_EQ(of_24_bits(0x021234), 0x06);
  const auto of_position = [](std::uint64_t value, unsigned count, bool is_22) {
    BitBuffer<64> bits;
    bits.append(0, 1);
    if (is_22) bits.append(1, 1);
    bits.append(detail::reversed(value, count), count);
    return crc_of_bits(bits.view(), 0, bits.size());
  };
  EXPECT_EQ(of_position(0x5F1, 13, false), 0x01);
  EXPECT_EQ(of_position(0x1FFF, 13, false), 0x04);
  EXPECT_EQ(of_position(0x1234567, 25, false), 0x06);
  EXPECT_EQ(of_position(0x1ADEADBEEF, 37, false), 0x15);
  EXPECT_EQ(of_position(0x1ADEADBEEF, 37, true), 0x1E);
  EXPECT_EQ(of_position(1234324343 & 0x1FFFFFF, 25, false), 0x1D);
}

TEST(EndatFrame, DecodesWhatItEncodes) {
  for (const unsigned bits : {13u, 25u, 32u, 37u, 48u}) {
    const Format format{.singleturn_bits = 13, .multiturn_bits = static_cast<std::uint8_t>(bits - 13), .info1 = 0x45};
    for (std::uint64_t value = 1; value < std::uint64_t{1} << bits; value = value * 3 + 1) {
      Reply reply{.position = value, .f1 = (value & 2) != 0, .f2 = (value & 4) != 0, .info_count = 1, .start = 15};
      reply.infos[0] = {.warning = true, .busy = true, .number = 5, .content = static_cast<std::uint16_t>(value)};
      BitBuffer<192> line;
      line.append(0, 7);
      encode_reply(format, ModeCommand::position_22, reply, line);
      const Result<Reply> decoded = decode_reply(format, {.code = ModeCommand::position_22}, line.view());
      ASSERT_TRUE(decoded) << bits << ' ' << value;
      EXPECT_EQ(*decoded, reply) << bits << ' ' << value;
    }
  }
}

TEST(EndatFrame, FindsHostsBitsInABurst) {
  const Format format{.singleturn_bits = 25, .info1 = 0x45};
  BitBuffer<256> burst;
  const Request request{.code = ModeCommand::read_22, .byte = 0x12};
  burst.append(encode_request(request).view().load(0, 8), 8);
  burst.append(0, 6);
  const std::size_t start = burst.size();
  Reply reply{.position = 77, .info_count = 1};
  reply.infos[0].number = 5;
  encode_reply(format, request.code, reply, burst);
  const std::size_t end = burst.size();
  const author::HostBits supplement = encode_supplement(request);
  burst.append(supplement.view().load(0, static_cast<unsigned>(supplement.size())),
               static_cast<unsigned>(supplement.size()));
  const BitRanges ranges = host_ranges(format, burst.view());
  ASSERT_EQ(ranges.size(), 2u);
  EXPECT_EQ(ranges[0].count, 8u);
  EXPECT_EQ(ranges[1].first, end);
  EXPECT_EQ(ranges[1].count, supplement.size());
  EXPECT_EQ(end - start, 1 + reply_size(format, request.code));
}

TEST(EndatFrame, RefusesRequestsThatAreNone) {
  const auto error_of = [](std::vector<std::uint8_t> bytes, std::size_t bits) {
    return decode_request({bytes, bits}).error();
  };
  EXPECT_EQ(error_of({0x00}, 4), Error::wrong_length);
  EXPECT_EQ(error_of({0x3F}, 8), Error::unexpected_reply) << "no mode command";
  EXPECT_EQ(error_of({0xC7}, 8), Error::out_of_range) << "ones in the two clocks before the mode command";
  EXPECT_EQ(error_of({0x07}, 8), Error::none);
  EXPECT_EQ(error_of({0x07, 0x00}, 16), Error::wrong_length);
}

TEST(EndatFrame, ReplyToAWriteRepeatsTheWord) {
  const Request write{.code = ModeCommand::write, .byte = 8, .word = 0x1234};
  for (const std::uint16_t word : std::to_array<std::uint16_t>({0x1234, 0x1235})) {
    BitBuffer<192> line;
    line.append(0, turn_bits);
    encode_reply({}, write.code, {.byte = 8, .word = word}, line);
    EXPECT_EQ(decode_reply({}, write, line.view()).error(), word == 0x1234 ? Error::none : Error::request_rejected);
  }
}

TEST(EndatFrame, AdditionalInformationBeginsWithZero) {
  const Format format{.singleturn_bits = 25, .info1 = 0x45};
  const Request request{.code = ModeCommand::position_22};
  Reply reply{.position = 5, .info_count = 1};
  reply.infos[0].number = 5;
  BitBuffer<192> line;
  line.append(0, turn_bits);
  encode_reply(format, request.code, reply, line);
  ASSERT_TRUE(decode_reply(format, request, line.view()));
  std::vector<std::uint8_t> bytes(line.bytes().begin(), line.bytes().end());
  const std::size_t first = turn_bits + 1 + position_size(format, request.code);
  bytes[first / 8] = static_cast<std::uint8_t>(bytes[first / 8] | 0x80 >> first % 8);
  EXPECT_EQ(decode_reply(format, request, {bytes, line.size()}).error(), Error::bad_checksum);
}

TEST(EndatFrame, SearchForInformationNeedsAHighLineBehindTheReply) {
  const Format format{.singleturn_bits = 25};
  const Request seeking{.code = ModeCommand::position_22, .seeks_infos = true};
  const auto behind = [&](std::uint64_t bits) {
    BitBuffer<192> line;
    line.append(0, turn_bits);
    encode_reply(format, seeking.code, {.position = 5}, line);
    line.append(bits, 60);
    return decode_reply(format, seeking, line.view()).error();
  };
  EXPECT_EQ(behind(low_mask(60)), Error::none);
  EXPECT_EQ(behind(low_mask(60) & ~std::uint64_t{1}), Error::bad_checksum) << "the last bit is low";
  EXPECT_EQ(behind(0), Error::bad_checksum) << "the encoder drives zeros";
}

// ---- Alarms in captures

constexpr Format rotary{.singleturn_bits = 25};

// A follower that is given exchanges with valid replies, whose start bits come `zeros` clocks late.
struct FollowerBench {
  void follow(const Request& request, const Reply& reply, std::size_t zeros = 3) {
    BitBuffer<256> bits;
    for (std::size_t i = 0; i < turn_bits + zeros; ++i) bits.append(0, 1);
    encode_reply(format, request.code, reply, bits);
    while (bits.size() < 240) bits.append(1, 1);
    follower.follow(number++, encode_request(request).bytes(), bits.bytes());
  }
  void follow_word(const Request& request, std::uint16_t word) {
    follow(request, {.byte = request.byte, .word = word}, 120);
  }
  void follow_alarms(std::uint16_t errors, std::uint16_t warnings) {
    follow_word(alarm_requests[0], 0);
    follow_word(alarm_requests[1], errors);
    follow_word(alarm_requests[2], warnings);
  }
  // Returns the request and the reply of the next composed frame; nothing: there is none.
  std::optional<std::pair<Request, Reply>> take() {
    Composed one;
    if (!follower.take(one)) return std::nullopt;
    first = one.first;
    const Result<Request> request = decode_request({one.request, 8 * one.request.size()});
    if (!request) return std::nullopt;
    const Result<Reply> reply = decode_reply(format, *request, {one.reply, 8 * one.reply.size()});
    if (!reply) return std::nullopt;
    return std::pair(*request, *reply);
  }
  Format format = rotary;
  AlarmWordsFollower follower{format};
  std::uint64_t number = 7;
  std::uint64_t first = 0;
};

TEST(EndatFollower, ComposesPositionWithTheAlarmsBehindIt) {
  for (const ModeCommand code : {ModeCommand::position, ModeCommand::position_22}) {
    for (const std::uint8_t info : std::to_array<std::uint8_t>({0, 0x4D})) {
      FollowerBench bench{.format = {.singleturn_bits = 25, .info1 = info}};
      Reply reply{.position = 0x1234567, .f1 = true, .f2 = code == ModeCommand::position};
      if (code == ModeCommand::position_22 && info != 0) {
        reply.info_count = 1;
        reply.infos[0] = {.warning = true, .number = 0x0D, .content = 3000};
      }
      bench.follow({.code = code}, reply);
      bench.follow_alarms(0x02, 0x10);
      const auto composed = bench.take();
      ASSERT_TRUE(composed);
      EXPECT_TRUE(composed->first.with_alarms);
      EXPECT_EQ(composed->first.code, code);
      EXPECT_EQ(bench.first, 7u);
      EXPECT_EQ(composed->second.position, 0x1234567u);
      EXPECT_EQ(composed->second.infos, reply.infos);
      const Reading reading = reading_of(bench.format, code, composed->second);
      EXPECT_EQ(reading.alarms, 0x1002u | alarm::error | alarm::warning);
      EXPECT_EQ(reading.singleturn_valid_bits, 0u);
      EXPECT_FALSE(bench.take()) << "once only";
    }
  }
}

TEST(EndatFollower, NeedsTheFourExchangesInTheirOrder) {
  FollowerBench bench;
  const Reply position{.position = 5};
  bench.follow_alarms(1, 1);
  EXPECT_FALSE(bench.take()) << "no position";
  bench.follow({.code = ModeCommand::position_22}, position);
  bench.follow_word(alarm_requests[0], 0);
  bench.follow_word(alarm_requests[2], 0);
  bench.follow_word(alarm_requests[1], 0);
  EXPECT_FALSE(bench.take()) << "another order";
  bench.follow({.code = ModeCommand::position_22}, position);
  bench.follow_word({.code = ModeCommand::select, .byte = area::maker_1}, 0);
  bench.follow_word(alarm_requests[1], 0);
  bench.follow_word(alarm_requests[2], 0);
  EXPECT_FALSE(bench.take()) << "another area";
  bench.follow({.code = ModeCommand::position_22}, {.position = 4});
  bench.follow({.code = ModeCommand::position_22}, position);
  bench.follow_word(alarm_requests[0], 0);
  bench.follower.lose();
  bench.follow_word(alarm_requests[1], 0);
  EXPECT_FALSE(bench.take());
  bench.follow_word(alarm_requests[2], 0);
  const auto composed = bench.take();
  ASSERT_TRUE(composed);
  EXPECT_EQ(composed->second.position, 5u);
  EXPECT_EQ(composed->second.alarm_words, AlarmWords{});
  bench.follow_word(alarm_requests[2], 0);
  EXPECT_FALSE(bench.take()) << "the words again, without a position";
}

TEST(EndatFollower, ComposedFrameIsDecodedOnlyWhole) {
  FollowerBench bench;
  bench.follow({.code = ModeCommand::position_22}, {.position = 5});
  bench.follow_alarms(0x01, 0);
  Composed one;
  ASSERT_TRUE(bench.follower.take(one));
  std::vector<std::uint8_t> request(one.request.begin(), one.request.end());
  std::vector<std::uint8_t> reply(one.reply.begin(), one.reply.end());
  const auto asked = [&request] { return decode_request({request, 8 * request.size()}); };
  ASSERT_TRUE(asked());
  const auto answer = [&] { return decode_reply(rotary, *asked(), {reply, 8 * reply.size()}); };
  ASSERT_TRUE(answer());
  EXPECT_EQ(answer()->alarm_words, (AlarmWords{1, 0}));
  const auto error_with_wrong = [&](std::size_t bit) {
    std::uint8_t& byte = reply[bit / 8];
    const std::uint8_t sound = byte;
    byte = static_cast<std::uint8_t>(sound ^ 0x80 >> bit % 8);
    const Error error = answer().error();
    byte = sound;
    return error;
  };
  constexpr std::size_t start = turn_bits + 1;
  const std::size_t words = 8 * reply.size() - 3 * access_bits;
  for (std::size_t bit = 0; bit < reply_size(rotary, ModeCommand::position_22); ++bit) {
    EXPECT_EQ(error_with_wrong(start + bit), Error::bad_checksum) << bit;
  }
  for (std::size_t bit = 0; bit < 3 * access_bits; ++bit) {
    if (bit % access_bits < start) continue;
    EXPECT_EQ(error_with_wrong(words + bit), Error::bad_checksum) << bit;
  }
  reply.resize(12);
  EXPECT_EQ(answer().error(), Error::truncated);
  request[2] = 0xA1;
  EXPECT_EQ(asked().error(), Error::wrong_length);
}

// README.md, section "Checksum": the least number of wrong bits that the CRC may miss, by the number of bits
// that it covers, and the share of such patterns.
TEST(EndatFrame, ChecksumBetraysEveryOddNumberOfWrongBits) {
  for (const unsigned covered : {14u, 26u, 27u, 38u, 39u, 50u, 24u}) {
    // Syndromes of single wrong bits, of the covered bits and of the checksum.
    std::vector<unsigned> syndromes;
    for (unsigned bit = 0; bit < covered + crc_bits; ++bit) {
      BitBuffer<64> word;
      for (unsigned i = 0; i < covered + crc_bits; ++i) word.append(i == bit ? 1 : 0, 1);
      const unsigned crc = crc_of_bits(word.view(), 0, covered);
      BitBuffer<64> zeros;
      zeros.append(0, covered);
      const unsigned rest = static_cast<unsigned>(word.view().load(covered, crc_bits));
      syndromes.push_back(crc ^ crc_of_bits(zeros.view(), 0, covered) ^ rest);
    }
    unsigned pairs = 0;
    unsigned missed = 0;
    for (std::size_t a = 0; a < syndromes.size(); ++a) {
      EXPECT_NE(syndromes[a], 0u);
      EXPECT_TRUE(std::popcount(syndromes[a]) % 2 == 1 || covered > 0);
      for (std::size_t b = a + 1; b < syndromes.size(); ++b) {
        ++pairs;
        if (syndromes[a] == syndromes[b]) ++missed;
        for (std::size_t c = b + 1; c < syndromes.size(); ++c) {
          EXPECT_NE(syndromes[a] ^ syndromes[b] ^ syndromes[c], 0u);
        }
      }
    }
    RecordProperty("missed_pairs_of_" + std::to_string(covered),
                   std::to_string(missed) + " of " + std::to_string(pairs));
    // x^4 + x^3 + 1 without the factor x + 1 repeats after 15 bits, so pairs 15 bits apart are missed.
    const unsigned length = covered + crc_bits;
    unsigned expected = 0;
    for (unsigned distance = 15; distance < length; distance += 15) expected += length - distance;
    EXPECT_EQ(missed, expected) << covered;
  }
}

}  // namespace
}  // namespace absenc::endat
