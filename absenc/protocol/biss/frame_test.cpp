// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/biss/frame.hpp"

#include <gtest/gtest.h>

#include <string_view>

#include "absenc/sim/random.hpp"

namespace absenc::biss {
namespace {

Format of_bits(unsigned bits) { return {.word = word_with_status({.position = bits})}; }

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

TEST(BissFrame, HammingDistanceIsThreeUpTo55BitsAndTwoAbove) {
  for (unsigned bits = 1; bits <= 64; ++bits) {
    const Format format = of_bits(bits);
    const std::uint64_t position = 0x5A5A'1234'9876'FEDC & low_mask(bits);
    const BitBuffer<512> samples = samples_of(format, {.word = {.position = position}}, 2);
    ASSERT_EQ(decode(format, samples.view())->word.position, position) << bits;
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

TEST(BissFrame, DecodesAtEveryOffsetInSixtyFourSamples) {
  const Format format = of_bits(32);
  const Word word{.position = 0x89AB'CDEF, .warning = true};
  unsigned offsets = 0;
  for (unsigned idle = 0; idle + 1 + 2 + data_bits(format) <= 64; ++idle) {
    for (unsigned ack = 1; idle + ack + 2 + data_bits(format) <= 64; ++ack, ++offsets) {
      const unsigned behind = 64 - idle - ack - 2 - data_bits(format);
      const BitBuffer<512> samples = samples_of(format, {.ack_bits = ack, .word = word}, idle, behind);
      ASSERT_EQ(samples.size(), 64u);
      const Result<Reply> reply = decode(format, samples.view());
      ASSERT_TRUE(reply) << idle << ' ' << ack;
      EXPECT_EQ(reply->word, word);
      EXPECT_EQ(reply->ack_bits, ack);
    }
  }
  EXPECT_EQ(offsets, 22u * 23u / 2);
}

bool skips(const Format& format) { return format.word.find(Meaning::skip) != nullptr; }

// Expects equal results with the format at compile time and run time, for noise, whole and damaged frames.
template <const Format& format>
void agree(std::uint64_t seed) {
  sim::Random random(seed);
  unsigned good = 0;
  for (int i = 0; i < 20'000; ++i) {
    BitBuffer<512> samples;
    const auto idle = static_cast<unsigned>(random.below(9));
    if (random.chance(0.1)) {
      samples.append(~std::uint64_t{0} << random.below(64) & ~(random.next() >> random.below(64)), 64);
    } else {
      const Word word{.position = random.next(), .multiturn = random.next(), .values = {1, random.next(), 3}};
      const Reply reply{.ack_bits = static_cast<unsigned>(1 + random.below(30)), .word = word, .life_counter = 41};
      samples = samples_of(format, reply, idle, static_cast<unsigned>(random.below(9)));
    }
    std::array<std::uint8_t, 64> copy{};
    std::copy(samples.bytes().begin(), samples.bytes().end(), copy.begin());
    if (random.chance(0.3)) copy[random.below(8)] ^= static_cast<std::uint8_t>(1u << random.below(8));
    const std::size_t size = random.chance(0.2) ? random.below(samples.size() + 1) : samples.size();
    // the view ends with the last sample, so a read behind it is found
    const BitView view{Bytes(copy).first((size + 7) / 8), size};
    const auto known = decode<format>(view);
    const Result<Reply> given = decode(format, view);
    ASSERT_EQ(known.error(), given.error());
    if (!given) continue;
    ++good;
    // A decoded reply does not have the bits that the word format skips, so with such a format the frame that is
    // encoded again is not compared.
    Reply at_hand = *given;
    at_hand.delay_bits = 0;
    BitBuffer<512> again;
    EXPECT_TRUE(encode(format, at_hand, again));
    const std::size_t first = view[0] ? view.end_of_run(0) : 0;
    for (std::size_t k = idle_bits; k < again.size() && !skips(format); ++k) {
      ASSERT_EQ(again.view()[k], view[first + k - idle_bits]) << k;
    }
    EXPECT_EQ(known->ack_bits, given->ack_bits);
    EXPECT_EQ(known->crc, given->crc);
    EXPECT_EQ(known->life_counter, given->life_counter);
    EXPECT_EQ(known->word.position, given->word.position);
    EXPECT_EQ(known->word.multiturn, given->word.multiturn);
    EXPECT_EQ(known->word.error, given->word.error);
    EXPECT_EQ(known->word.warning, given->word.warning);
    for (std::size_t k = 0; k < known->word.values.size(); ++k) EXPECT_EQ(known->word.values[k], given->word.values[k]);
  }
  EXPECT_GT(good, 5'000u);
}

constexpr Format plain{};
constexpr Format turns{.word = "multiturn:16 position:32 error:1! warning:1!"_word};
// The word of this format is longer than 64 bits.
constexpr Format behind{.word = "position:13 multiturn:51 warning:1 gray parity:1!"_word};
constexpr Format values{.word = "position:20 temperature=value:8 error:1 skip:3 warning:1!"_word};
constexpr Format checked{.word = "position:24 error:1! warning:1!"_word, .check = crc16};
// Formats whose CRC is not the usual one of 6 bits, and a format with a long word.
constexpr Format other_crc{.word = "position:24 error:1! warning:1!"_word, .check = {8, 0x97}};
constexpr Format started{.word = "position:24 error:1! warning:1!"_word, .check = {16, 0x90D9, 0x1234, false, false}};
constexpr Format small_crc{.word = "position:8 error:1! warning:1!"_word, .check = {5, 0x05}};
constexpr Format long_checked{.word = "position:64 skip:20 error:1! warning:1!"_word, .check = crc16};

TEST(BissFrame, DecodesCompileTimeFormatLikeRunTimeFormat) {
  agree<plain>(1);
  agree<turns>(2);
  agree<behind>(3);
  agree<values>(4);
  agree<checked>(5);
  agree<long_checked>(6);
  agree<other_crc>(7);
  agree<started>(8);
  agree<small_crc>(9);
  static_assert(decode<plain>(BitView{}).error() == Error::wrong_length);
}

TEST(BissFrame, ComputesCrcOfAnyParameters) {
  sim::Random random(11);
  for (int i = 0; i < 2'000; ++i) {
    const auto width = static_cast<std::uint8_t>(3 + random.below(14));
    const auto mask = static_cast<std::uint16_t>(low_mask(width));
    const Check check{width, static_cast<std::uint16_t>(random.next() & mask),
                      static_cast<std::uint16_t>(random.next() & mask), random.chance(0.5), false};
    std::array<std::uint8_t, 16> bytes{};
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.next());
    const std::size_t size = 1 + random.below(bytes.size());
    const std::uint16_t right = crc_bitwise(parameters_of(check), Bytes(bytes).first(size));
    EXPECT_EQ(detail::crc_bit_by_bit(check, BitView{bytes, 128}, 0, 8 * size), right);
  }
}

TEST(BissFrame, SafetyCrcDetectsEveryErrorOfThreeBits) {
  const Format format{.word = word_with_status({.position = 24}), .check = crc16};
  const BitBuffer<512> samples =
      samples_of(format, {.ack_bits = 4, .word = {.position = 0xABCDEF}, .life_counter = 41}, 2);
  const Result<Reply> good = decode(format, samples.view());
  ASSERT_TRUE(good);
  EXPECT_EQ(good->life_counter, 41);
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

TEST(BissTiming, AckBitsFollowLatencyAndClock) {
  EXPECT_EQ(ack_bits(10us, 1us), 10u);
  EXPECT_EQ(ack_bits(10us, 999ns), 11u);
  EXPECT_EQ(ack_bits(10us, 28'571ns), 1u);
  EXPECT_EQ(ack_bits(0us, 100ns), 1u);
}

}  // namespace
}  // namespace absenc::biss
