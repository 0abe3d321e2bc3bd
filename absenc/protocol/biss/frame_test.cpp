// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/biss/frame.hpp"

#include <gtest/gtest.h>

#include <string_view>

#include "absenc/protocol/biss/timing.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::biss {
namespace {

Format of_bits(unsigned bits) { return {.word = word_with_status({.position = bits})}; }

/// The CRC straight from its definition, one bit after the other.
std::uint32_t plain_crc(BitView bits, std::size_t first, std::size_t count, unsigned width, std::uint32_t poly) {
  std::uint32_t remainder = 0;
  for (std::size_t i = first; i < first + count; ++i) {
    const bool feedback = ((remainder >> (width - 1) & 1) != 0) != bits[i];
    remainder = (remainder << 1 ^ (feedback ? poly : 0)) & static_cast<std::uint32_t>(low_mask(width));
  }
  return remainder ^ static_cast<std::uint32_t>(low_mask(width));
}

BitBuffer<512> samples_of(const Format& format, const Reply& reply, unsigned idle, unsigned behind = 0) {
  BitBuffer<512> frame;
  EXPECT_TRUE(encode(format, reply, frame));
  BitBuffer<512> samples;
  for (unsigned i = 0; i < idle; ++i) samples.append(1, 1);
  for (std::size_t i = idle_bits; i < frame.size(); ++i) samples.append(frame.view()[i] ? 1 : 0, 1);
  for (unsigned i = 0; i < behind; ++i) samples.append(i & 1, 1);
  return samples;
}

Bytes with_flip(std::array<std::uint8_t, 64>& copy, const BitBuffer<512>& samples,
                std::initializer_list<std::size_t> at) {
  std::copy(samples.bytes().begin(), samples.bytes().end(), copy.begin());
  for (const std::size_t bit : at) copy[bit / 8] ^= static_cast<std::uint8_t>(0x80u >> bit % 8);
  return copy;
}

TEST(BissFrame, CrcOfEveryLength) {
  sim::Random random(1);
  for (unsigned bits = 1; bits <= 64; ++bits) {
    const Format format = of_bits(bits);
    for (int i = 0; i < 20; ++i) {
      const Word word{.position = random.next() & low_mask(bits), .error = random.chance(0.5)};
      const BitBuffer<512> samples = samples_of(format, {.ack_bits = 3, .word = word}, 2);
      const Result<Reply> reply = decode(format, samples.view());
      ASSERT_TRUE(reply) << bits;
      EXPECT_EQ(reply->word, word);
      EXPECT_EQ(reply->ack_bits, 3u);
      EXPECT_EQ(reply->crc, plain_crc(samples.view(), 7, bits + 2, 6, 0x03));
    }
  }
}

// The check value of the catalogue, and numbers that fill a table's last step and go beyond 32 bits.
TEST(BissFrame, FastCrcIsTheDefinition) {
  sim::Random random(2);
  EXPECT_EQ(crc6(0), 0x3F);
  for (int i = 0; i < 10'000; ++i) {
    const std::uint64_t number = random.next() >> (i % 64);
    std::array<std::uint8_t, 8> bytes{};
    store_big_endian(bytes, number);
    ASSERT_EQ(crc6(number), crc_bitwise(crc6_parameters, bytes)) << number;
  }
}

TEST(BissFrame, HammingDistanceIsThreeUpTo55BitsAndTwoAbove) {
  for (unsigned bits = 1; bits <= 64; ++bits) {
    const Format format = of_bits(bits);
    const BitBuffer<512> samples =
        samples_of(format, {.word = {.position = 0x5A5A'1234'9876'FEDC & low_mask(bits)}}, 2);
    const std::size_t first = 5;
    std::array<std::uint8_t, 64> copy{};
    unsigned missed = 0;
    for (std::size_t a = first; a < samples.size(); ++a) {
      ASSERT_EQ(decode(format, {with_flip(copy, samples, {a}), samples.size()}).error(), Error::bad_checksum);
      for (std::size_t b = a + 1; b < samples.size(); ++b) {
        if (decode(format, {with_flip(copy, samples, {a, b}), samples.size()})) ++missed;
      }
    }
    EXPECT_EQ(missed == 0, bits <= 55) << bits << " bits, " << missed;
  }
}

TEST(BissFrame, EveryOffsetInSixtyFourSamples) {
  const Format format = of_bits(32);
  const Word word{.position = 0x89AB'CDEF, .warning = true};
  unsigned offsets = 0;
  for (unsigned idle = 0; idle + 1 + 2 + data_bits(format) <= 64; ++idle) {
    for (unsigned ack = 1; idle + ack + 2 + data_bits(format) <= 64; ++ack, ++offsets) {
      const unsigned behind = 64 - idle - ack - 2 - data_bits(format);
      const BitBuffer<512> samples = samples_of(format, {.ack_bits = ack, .word = word}, idle, behind);
      ASSERT_EQ(samples.size(), 64u);
      const Result<Framing> fast = find_frame(data_bits(format), samples.view().load(0, 64));
      ASSERT_TRUE(fast) << idle << ' ' << ack;
      EXPECT_EQ(fast->first, idle + ack + 2);
      EXPECT_EQ(fast->ack_bits, ack);
      const Result<Reply> reply = decode(format, samples.view());
      ASSERT_TRUE(reply);
      EXPECT_EQ(reply->word, word);
    }
  }
  EXPECT_EQ(offsets, 22u * 23u / 2);
}

// Noise, cut frames and frames with flips: the two ways to find a frame say the same of all of them.
TEST(BissFrame, FastAndGeneralWayAgree) {
  sim::Random random(3);
  for (int i = 0; i < 200'000; ++i) {
    const auto bits = static_cast<unsigned>(1 + random.below(50));
    const Format format = of_bits(bits);
    const auto size = static_cast<unsigned>(1 + random.below(64));
    std::array<std::uint8_t, 8> bytes{};
    std::uint64_t number = ~std::uint64_t{0} << random.below(64) & ~(random.next() >> random.below(64));
    if (random.chance(0.5)) {
      const Reply reply{.ack_bits = static_cast<unsigned>(1 + random.below(20)), .word = {.position = random.next()}};
      const BitBuffer<512> samples = samples_of(format, reply, static_cast<unsigned>(random.below(4)), 64);
      number = samples.view().load(0, 64);
      if (random.chance(0.3)) number ^= std::uint64_t{1} << random.below(64);
    }
    number = number >> (64 - size) << (64 - size);
    store_big_endian(bytes, number);
    const Result<Framing> fast = find_frame(data_bits(format), number, size);
    const Result<Framing> general = find_frame(format, BitView{bytes, size});
    ASSERT_EQ(text_of(fast.error()).name, text_of(general.error()).name) << number << ' ' << size << ' ' << bits;
    if (!fast) continue;
    ASSERT_EQ(fast->first, general->first);
    ASSERT_EQ(fast->ack_bits, general->ack_bits);
    ASSERT_EQ(fast->crc, general->crc);
  }
}

TEST(BissFrame, SafetyCrcSeesEveryErrorOfThreeBits) {
  const Format format{.word = word_with_status({.position = 24}), .check = Check::crc16};
  const BitBuffer<512> samples =
      samples_of(format, {.ack_bits = 4, .word = {.position = 0xABCDEF}, .life_counter = 41}, 2);
  const Result<Reply> good = decode(format, samples.view());
  ASSERT_TRUE(good);
  EXPECT_EQ(good->life_counter, 41);
  EXPECT_EQ(good->crc, plain_crc(samples.view(), 8, 32, 16, 0x90D9));
  std::array<std::uint8_t, 64> copy{};
  const auto error = [&](std::initializer_list<std::size_t> flips) {
    return decode(format, {with_flip(copy, samples, flips), samples.size()}).error();
  };
  for (std::size_t a = 8; a < samples.size(); ++a) {
    ASSERT_EQ(error({a}), Error::bad_checksum);
    for (std::size_t b = a + 1; b < samples.size(); ++b) {
      ASSERT_EQ(error({a, b}), Error::bad_checksum);
      for (std::size_t c = b + 1; c < samples.size(); ++c) ASSERT_EQ(error({a, b, c}), Error::bad_checksum);
    }
  }
}

TEST(BissFrame, TurnsInEitherOrderUpToSixtyFourBits) {
  for (const bool first : {true, false}) {
    const Format format{.word = word_with_status({.position = 40, .multiturn = 24, .multiturn_first = first})};
    const Word word{.position = 0x12'3456'789A, .multiturn = 0xFEDCBA};
    const BitBuffer<512> samples = samples_of(format, {.ack_bits = 200, .word = word}, 100, 50);
    const Result<Reply> reply = decode(format, samples.view());
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->word, word);
    EXPECT_EQ(reply->ack_bits, 200u);
    EXPECT_EQ(samples.view().load(302, 24) == 0xFEDCBA, first);
  }
}

TEST(BissFrame, AWordOfTheUser) {
  const Format format{.word = "position:20 temperature=value:8 error:1 skip:3 warning:1!"_word};
  const Word word{.position = 0xABCDE, .error = true, .values = {0, 25}};
  const BitBuffer<512> samples = samples_of(format, {.ack_bits = 2, .word = word}, 2);
  ASSERT_TRUE(decode(format, samples.view()));
  EXPECT_EQ(decode(format, samples.view())->word, word);
}

TEST(BissTiming, AckFollowsLatencyAndClock) {
  EXPECT_EQ(ack_bits(10us, 1us), 10u);
  EXPECT_EQ(ack_bits(10us, 999ns), 11u);
  EXPECT_EQ(ack_bits(10us, 28'571ns), 1u);
  EXPECT_EQ(ack_bits(0us, 100ns), 1u);
  EXPECT_EQ(longest_ack(of_bits(32), 64), 64u - 4 - 40);
  EXPECT_EQ(longest_ack(of_bits(48), 64), 4u);
  EXPECT_EQ(longest_ack(of_bits(60), 64), 0u);
}

}  // namespace
}  // namespace absenc::biss
