// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/endat/frame.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <vector>

#include "absenc/protocol/endat/protocol.hpp"

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
