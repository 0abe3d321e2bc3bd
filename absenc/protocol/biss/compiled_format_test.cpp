// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/biss/compiled_format.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "absenc/protocol/random_word_test.hpp"

namespace absenc::biss {
namespace {

using Samples = BitBuffer<512>;

Check random_check(sim::Random& random) {
  if (random.below(4) == 0) return random.below(2) != 0 ? crc6 : crc16;
  return {.width = static_cast<std::uint8_t>(random.below(17)),
          .poly = static_cast<std::uint16_t>(random.next()),
          .init = static_cast<std::uint16_t>(random.next()),
          .inverted = random.below(2) != 0,
          .life_counter = random.below(2) != 0};
}

Word random_values(sim::Random& random) {
  Word word{.position = random.next(),
            .multiturn = random.next(),
            .error = random.below(2) != 0,
            .warning = random.below(2) != 0};
  for (std::uint64_t& value : word.values) value = random.next();
  return word;
}

ChannelData random_data(sim::Random& random) {
  return {.word = random_values(random), .life_counter = static_cast<std::uint8_t>(random.next() & 0x3F)};
}

// Returns the samples with a random change: none, the end cut off, bits appended, or one to three bits flipped.
Samples disturbed(const Samples& samples, sim::Random& random) {
  Samples changed;
  const std::uint64_t kind = random.below(8);
  const std::size_t size = kind == 0 ? random.below(samples.size() + 1) : samples.size();
  for (std::size_t i = 0; i < size; ++i) changed.append(samples.view()[i] ? 1 : 0, 1);
  if (kind == 1) changed.append(random.next(), static_cast<unsigned>(random.below(65)));
  std::array<std::uint8_t, 64> bytes{};
  std::copy(changed.bytes().begin(), changed.bytes().end(), bytes.begin());
  if (kind >= 2 && kind <= 4 && size != 0) {
    const std::uint64_t flips = 1 + random.below(3);
    for (std::uint64_t i = 0; i < flips; ++i) {
      const std::size_t at = random.below(size);
      bytes[at / 8] ^= static_cast<std::uint8_t>(0x80u >> at % 8);
    }
    changed.clear();
    for (std::size_t i = 0; i < size; ++i) changed.append(BitView{bytes, size}[i] ? 1 : 0, 1);
  }
  return changed;
}

template <class ReplyType>
void expect_equal_heads(const ReplyType& reply, const ReplyType& expected) {
  EXPECT_EQ(reply.ack_bits, expected.ack_bits);
  EXPECT_EQ(reply.delay_bits, expected.delay_bits);
  EXPECT_EQ(reply.cds, expected.cds);
}
template <class Data>
void expect_equal_data(const Data& data, const Data& expected) {
  EXPECT_EQ(data.word, expected.word);
  EXPECT_EQ(data.life_counter, expected.life_counter);
  EXPECT_EQ(data.crc, expected.crc);
}

// Returns a random number of ACK bits, sometimes so many that they end beyond the first 64 samples.
unsigned random_ack(sim::Random& random) {
  return static_cast<unsigned>(1 + random.below(random.below(4) == 0 ? 90 : 20));
}

TEST(BissCompiledFormat, EqualsFormatForRandomFormatsAndFrames) {
  sim::Random random(17);
  unsigned good = 0;
  unsigned bad = 0;
  for (unsigned i = 0; i < 8'000; ++i) {
    const Format format{.word = random_word(random), .check = random_check(random)};
    const CompiledFormat compiled(format);
    for (unsigned j = 0; j < 8; ++j) {
      const ChannelData data = random_data(random);
      Samples samples;
      ASSERT_TRUE(encode(format,
                         {.ack_bits = random_ack(random),
                          .word = data.word,
                          .life_counter = data.life_counter,
                          .cds = random.below(4) == 0,
                          .delay_bits = static_cast<unsigned>(random.below(4))},
                         samples));
      const Samples received = disturbed(samples, random);
      const Cds cds = random.below(2) != 0 ? Cds::any : Cds::zero;
      const Result<Reply> expected = decode(format, received.view(), cds);
      const Result<Reply> reply = decode(compiled, received.view(), cds);
      ASSERT_EQ(reply.error(), expected.error()) << i;
      expected ? ++good : ++bad;
      if (!expected) continue;
      expect_equal_heads(*reply, *expected);
      expect_equal_data(*reply, *expected);
      ASSERT_FALSE(HasFailure()) << "format " << i;
    }
  }
  EXPECT_GT(good, 20'000u);
  EXPECT_GT(bad, 10'000u);
}

TEST(BissCompiledFormat, EqualsFormatForNoise) {
  sim::Random random(19);
  for (unsigned i = 0; i < 20'000; ++i) {
    const Format format{.word = random_word(random), .check = random_check(random)};
    Samples noise;
    for (std::uint64_t bits = random.below(140); bits > 0; --bits) noise.append(random.below(2), 1);
    EXPECT_EQ(decode(CompiledFormat(format), noise.view()).error(), decode(format, noise.view()).error()) << i;
  }
}

TEST(BissCompiledSafetyFormat, EqualsFormatForRandomFormatsAndFrames) {
  sim::Random random(23);
  unsigned good = 0;
  for (unsigned i = 0; i < 8'000; ++i) {
    SafetyFormat format{.cpw = {.word = random_word(random), .check = random_check(random)},
                        .spw = {.word = random_word(random), .check = random_check(random)}};
    format.compare_bits = static_cast<std::uint8_t>(random.below(12));
    if (random.below(2) != 0) format.previous_life_counter = static_cast<std::int8_t>(random.below(64));
    const CompiledSafetyFormat compiled(format);
    for (unsigned j = 0; j < 8; ++j) {
      SafetyReply sent{.ack_bits = random_ack(random), .cpw = random_data(random), .spw = random_data(random)};
      // Makes the positions of both words agree, and in most frames the life counter follow the previous one.
      const unsigned spw_bits = format.spw.word.bits_of(Meaning::position);
      const unsigned cpw_bits = format.cpw.word.bits_of(Meaning::position);
      const std::uint64_t upper = sent.cpw.word.position & low_mask(cpw_bits);
      sent.spw.word.position = cpw_bits >= spw_bits ? upper >> (cpw_bits - spw_bits) : upper << (spw_bits - cpw_bits);
      sent.spw.word.multiturn = sent.cpw.word.multiturn;
      if (random.below(4) != 0) {
        sent.spw.life_counter = static_cast<std::uint8_t>((format.previous_life_counter + 1) & 0x3F);
      }
      Samples samples;
      ASSERT_TRUE(encode(format, sent, samples));
      const Samples received = disturbed(samples, random);
      const Result<SafetyReply> expected = decode(format, received.view());
      const Result<SafetyReply> reply = decode(compiled, received.view());
      ASSERT_EQ(reply.error(), expected.error()) << i;
      if (!expected) continue;
      ++good;
      expect_equal_heads(*reply, *expected);
      expect_equal_data(reply->cpw, expected->cpw);
      expect_equal_data(reply->spw, expected->spw);
      ASSERT_FALSE(HasFailure()) << "format " << i;
    }
  }
  EXPECT_GT(good, 5'000u);
}

// A CRC with start value 0 that is not inverted fits zeros, but BiSS Safety refuses a word of zeros.
TEST(BissCompiledSafetyFormat, RefusesZerosInPlaceOfEitherWord) {
  constexpr Check plain{.width = 8, .poly = 0x07, .init = 0, .inverted = false};
  constexpr SafetyFormat format{.cpw = {.word = "position:16"_word, .check = plain},
                                .spw = {.word = "position:12"_word, .check = plain},
                                .compare_bits = 9};
  for (const std::uint64_t cpw : {0u, 1u}) {
    for (const std::uint64_t spw : {0u, 1u}) {
      Samples samples;
      ASSERT_TRUE(encode(format, {.cpw = {.word = {.position = cpw}}, .spw = {.word = {.position = spw}}}, samples));
      const Error expected = cpw != 0 && spw != 0 ? Error::none : Error::line_stuck;
      EXPECT_EQ(decode(format, samples.view()).error(), expected) << cpw << spw;
      EXPECT_EQ(decode(CompiledSafetyFormat(format), samples.view()).error(), expected) << cpw << spw;
    }
  }
}

// ---- Formats that are known at compile time

constexpr std::array known_formats{
    Format{.word = "position:19 error:1! warning:1!"_word},
    Format{.word = "position:57 error:1! warning:1!"_word},
    Format{.word = "multiturn:12 position:24 error:1! warning:1! gray"_word, .check = crc16},
    Format{.word = "a=value:3! skip:2 position:20 error:1 b=value:7 parity:1!"_word,
           .check = {.width = 5, .poly = 0x15, .init = 0x1F, .inverted = false}},
    Format{.word = "position:60 skip:9"_word},
};

template <std::size_t index>
void expect_known_equals_given() {
  static constexpr Format format = known_formats[index];
  sim::Random random(29 + index);
  for (unsigned i = 0; i < 4'000; ++i) {
    const ChannelData data = random_data(random);
    Samples samples;
    ASSERT_TRUE(encode(format,
                       {.ack_bits = random_ack(random),
                        .word = data.word,
                        .life_counter = data.life_counter,
                        .cds = random.below(4) == 0},
                       samples));
    const Samples received = disturbed(samples, random);
    const Result<Reply> expected = decode(format, received.view());
    const auto reply = decode<format>(received.view());
    ASSERT_EQ(reply.error(), expected.error()) << i;
    if (!expected) continue;
    EXPECT_EQ(reply->ack_bits, expected->ack_bits);
    EXPECT_EQ(reply->delay_bits, expected->delay_bits);
    EXPECT_EQ(reply->crc, expected->crc);
    EXPECT_EQ(reply->life_counter, expected->life_counter);
    EXPECT_EQ(reply->word.position, expected->word.position);
    EXPECT_EQ(reply->word.multiturn, expected->word.multiturn);
    EXPECT_EQ(reply->word.error, expected->word.error);
    EXPECT_EQ(reply->word.warning, expected->word.warning);
    for (std::size_t field = 0; field < reply->word.values.size(); ++field) {
      EXPECT_EQ(reply->word.values[field], expected->word.values[field]) << field;
    }
  }
}

TEST(BissKnownFormat, EqualsGivenFormat) {
  [&]<std::size_t... index>(std::index_sequence<index...>) { (expect_known_equals_given<index>(), ...); }
  (std::make_index_sequence<known_formats.size()>{});
}

}  // namespace
}  // namespace absenc::biss
