// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/ssi/frame.hpp"

#include <gtest/gtest.h>

#include <string_view>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/vector_check.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::ssi {
namespace {

BitBuffer<256> bits(std::string_view text) {
  return bits_of_text({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

Result<Word> decode(const Format& format, std::string_view text) { return ssi::decode(format, bits(text).view()); }

// RAA38S6, paragraph 3.5: the number that 8 clocks give, taken for 12 bits, is at most 22.4121 degrees.
TEST(SsiFrame, RejectsTooFewClocks) {
  EXPECT_NEAR(degrees(255, 12), 22.4121, 0.0001);
  for (std::size_t size = 0; size < 12; ++size) {
    EXPECT_EQ(decode({}, std::string(size, '1')).error(), Error::wrong_length) << size;
  }
}

// RAA38S6, paragraph 3.5: with too many clocks the position can be thousands of degrees.
TEST(SsiFrame, RejectsTooManyClocks) {
  for (std::uint64_t position = 0; position < 4096; ++position) {
    BitBuffer<64> read;
    ASSERT_TRUE(encode({}, {.position = position}, 14, read));
    const std::uint64_t number = read.view().load(0, 14);
    EXPECT_EQ(ssi::decode({}, read.view()).error(), number > 4095 ? Error::out_of_range : Error::wrong_length);
  }
}

TEST(SsiFrame, ReadingTwiceDetectsAnyWrongBit) {
  const Format format{.extra_clocks = 12};
  // If the format has no extra clocks, `decode` accepts the bits of one word, and also those of the same word sent
  // twice.
  EXPECT_EQ(decode({}, "000111101111000111101111")->position, 495u);
  std::string text = "000111101111000111101111";
  for (char& c : text) {
    c ^= 1;
    EXPECT_EQ(decode(format, text).error(), Error::cross_check_failed);
    c ^= 1;
  }
  EXPECT_EQ(decode(format, text.substr(0, 12)).error(), Error::wrong_length);
}

TEST(SsiFrame, ExtraClocksDetectWrongNumberOfBits) {
  unsigned missed = 0;
  for (std::uint64_t position = 0; position < 4096; ++position) {
    for (const unsigned wrong : {11u, 13u}) {
      const WordFormat word = word_format({.position = wrong});
      BitBuffer<64> read;
      ASSERT_TRUE(encode({.word = word_format({.position = 12})}, {.position = position}, 2 * wrong, read));
      if (ssi::decode({.word = word, .extra_clocks = wrong}, read.view())) ++missed;
    }
  }
  EXPECT_EQ(missed, 4u);  // positions 0 and 4095, whose bits are all alike
}

TEST(SsiFrame, ChecksBitsAfterWord) {
  const Format zero{.after_word = AfterWord::zero, .extra_clocks = 2};
  const Format one{.after_word = AfterWord::one, .extra_clocks = 2};
  EXPECT_TRUE(decode(zero, "00011110111100"));
  EXPECT_EQ(decode(zero, "00011110111110").error(), Error::cross_check_failed);
  EXPECT_TRUE(decode(one, "00011110111111"));
  EXPECT_EQ(decode(one, "00011110111101").error(), Error::cross_check_failed);
  EXPECT_EQ(decode(zero, "11111111111111").error(), Error::line_stuck);
  EXPECT_EQ(decode(one, "00000000000000").error(), Error::line_stuck);
  EXPECT_TRUE(decode(zero, "00000000000000"));  // a word whose bits are all 0 is valid: its position is 0
}

TEST(SsiFrame, EncodeFailsWithoutRoom) {
  BitBuffer<64> room;
  EXPECT_TRUE(encode({}, {.position = 495}, 24, room));
  EXPECT_FALSE(encode({}, {.position = 495}, 41, room));
  EXPECT_EQ(room.size(), 24u);
  EXPECT_TRUE(encode({}, {.position = 495}, 40, room));
  EXPECT_EQ(room.size(), 64u);
}

template <const Format& format>
void agree() {
  sim::Random random(1);
  unsigned good = 0;
  for (int i = 0; i < 10'000; ++i) {
    BitBuffer<frame_capacity> read;
    const Word word{.position = random.next(), .multiturn = random.next(), .error = random.chance(0.5)};
    ASSERT_TRUE(encode(format, word, random.chance(0.8) ? clocks(format) : random.below(100), read));
    std::array<std::uint8_t, frame_capacity / 8> copy{};
    std::copy(read.bytes().begin(), read.bytes().end(), copy.begin());
    if (random.chance(0.3)) copy[random.below(4)] ^= static_cast<std::uint8_t>(1u << random.below(8));
    const auto known = ssi::decode<format>({Bytes(copy).first(read.bytes().size()), read.size()});
    const Result<Word> given = ssi::decode(format, {copy, read.size()});
    ASSERT_EQ(known.error(), given.error());
    if (!given) continue;
    ++good;
    // Encoding the fields of an accepted word must give the same bits, with those after the word.
    BitBuffer<frame_capacity> again;
    EXPECT_TRUE(encode(format, *given, read.size(), again));
    for (std::size_t k = 0; k < again.size(); ++k) ASSERT_EQ(again.view()[k], (BitView{copy, read.size()}[k])) << k;
    EXPECT_EQ(known->position, given->position);
    EXPECT_EQ(known->multiturn, given->multiturn);
    EXPECT_EQ(known->error, given->error);
  }
  EXPECT_GT(good, 4'000u);
}

constexpr Format plain{};
constexpr Format zeros{
    .word = "multiturn:12 position:13 gray error:1! parity:1"_word, .after_word = AfterWord::zero, .extra_clocks = 2};
constexpr Format twice{.word = "position:24 gray"_word, .extra_clocks = 24};

TEST(SsiFrame, DecodesCompileTimeFormatLikeRunTimeFormat) {
  agree<plain>();
  agree<zeros>();
  agree<twice>();
}

}  // namespace
}  // namespace absenc::ssi
