// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/compiled_word.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/random_word_test.hpp"

namespace absenc {
namespace {

BitBuffer<64> buffer_of(std::uint64_t number, unsigned bits) {
  BitBuffer<64> buffer;
  buffer.append(number, bits);
  return buffer;
}

TEST(CompiledWord, EqualsDecodeWordForRandomFormats) {
  sim::Random random(11);
  unsigned compiled = 0;
  for (unsigned i = 0; i < 20'000; ++i) {
    const WordFormat format = random_word(random);
    if (format.bits() > CompiledWord::maximum_bits) continue;
    ++compiled;
    const auto behind = static_cast<unsigned>(random.below(CompiledWord::maximum_bits - format.bits() + 1));
    const CompiledWord word(format, behind);
    for (unsigned j = 0; j < 8; ++j) {
      const std::uint64_t number = random.next() & low_mask(format.bits() + behind);
      const BitBuffer<64> bits = buffer_of(number, format.bits() + behind);
      const Result<Word> expected = decode_word(format, bits.view());
      ASSERT_EQ(word.is_parity_right(number), expected.has_value()) << i;
      if (!expected) continue;
      ASSERT_EQ(word.values_of<Word>(number), *expected) << i;
    }
  }
  EXPECT_GT(compiled, 10'000u);
}

TEST(CompiledWord, PositionAndTurnsOf64BitsInEitherOrder) {
  for (const bool gray : {false, true}) {
    for (unsigned turns = 0; turns < 64; ++turns) {
      for (const bool turns_first : {false, true}) {
        WordFormat format = word_format({64 - turns, turns, turns_first});
        if (gray) format.set_gray();
        ASSERT_EQ(format.bits(), 64u);
        const std::uint64_t number = 0x9E37'79B9'7F4A'7C15;
        EXPECT_EQ(CompiledWord(format).values_of<Word>(number), *decode_word(format, buffer_of(number, 64).view()))
            << turns << (turns_first ? " turns first" : " turns last");
      }
    }
  }
}

TEST(CompiledWord, PaddingIsZeroOnlyIfAllSkippedBitsAre) {
  constexpr CompiledWord word{"skip:2 position:4 skip:1!"_word};
  EXPECT_TRUE(word.is_padding_zero(0b0011110));
  for (const unsigned bit : {0u, 5u, 6u}) EXPECT_FALSE(word.is_padding_zero(0b0011110 | 1u << bit)) << bit;
}

}  // namespace
}  // namespace absenc
