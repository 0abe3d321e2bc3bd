// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/ssi/compiled_format.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/random_word_test.hpp"

namespace absenc::ssi {
namespace {

// Returns `word` with a parity bit: if it has none, one is added at the end.
WordFormat with_error_parity(WordFormat word) {
  if (word.find(Meaning::parity) == nullptr) word.add({"parity", Meaning::parity, 1});
  return word;
}

TEST(SsiCompiledFormat, EqualsFormatForRandomFormatsAndWords) {
  sim::Random random(31);
  unsigned good = 0;
  for (unsigned i = 0; i < 8'000; ++i) {
    Format format{.word = random_word(random), .after_word = static_cast<AfterWord>(random.below(4))};
    if (random.below(4) == 0) format.extra_clocks = static_cast<unsigned>(random.below(20));
    format.padded = random.below(4) == 0;
    if (random.below(4) == 0) {
      format.word = with_error_parity(format.word);
      format.error_parity = format.word.fields().back().meaning == Meaning::parity;
    }
    const CompiledFormat compiled(format);
    for (unsigned j = 0; j < 8; ++j) {
      Word word{.position = random.next(), .multiturn = random.next(), .error = random.below(2) != 0};
      for (std::uint64_t& value : word.values) value = random.next();
      const std::size_t usual = clocks(format);
      const std::size_t twice = 2 * format.word.bits() + (format.after_word == AfterWord::separated ? 1 : 0);
      const std::array lengths{usual, usual, usual, twice, usual + 1, usual - 1};
      BitBuffer<2 * frame_capacity> sent;
      ASSERT_TRUE(encode(format, word, lengths[random.below(lengths.size())], sent));
      BitBuffer<2 * frame_capacity> received;
      const bool noisy = random.below(4) == 0;
      for (std::size_t bit = 0; bit < sent.size(); ++bit) {
        received.append((sent.view()[bit] ? 1u : 0u) ^ (noisy && random.below(20) == 0 ? 1u : 0u), 1);
      }
      const Result<Word> expected = decode(format, received.view());
      const Result<Word> found = decode(compiled, received.view());
      ASSERT_EQ(found.error(), expected.error()) << i;
      if (!expected) continue;
      ++good;
      ASSERT_EQ(*found, *expected) << i;
    }
  }
  EXPECT_GT(good, 20'000u);
}

}  // namespace
}  // namespace absenc::ssi
