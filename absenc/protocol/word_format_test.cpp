// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/word_format.hpp"

#include <gtest/gtest.h>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/word.hpp"

namespace absenc {
namespace {

struct Parsed {
  WordFormat format;
  WordFormatError error;
};

Parsed parse(std::string_view text) {
  Parsed parsed;
  parsed.error = parse_word_format(text, parsed.format);
  return parsed;
}

TEST(WordFormat, ReadsFieldsInTheOrderOfTheWire) {
  const Parsed parsed = parse("multiturn:12 position:24 error:1! warning:1! skip:2 battery=value:3 gray");
  ASSERT_EQ(parsed.error.reason, "");
  const std::span<const WordField> fields = parsed.format.fields();
  ASSERT_EQ(fields.size(), 6u);
  EXPECT_EQ(fields[0].meaning, Meaning::multiturn);
  EXPECT_EQ(fields[0].bits, 12u);
  EXPECT_FALSE(fields[0].active_low);
  EXPECT_EQ(fields[1].name, "position");
  EXPECT_TRUE(fields[2].active_low);
  EXPECT_EQ(fields[4].meaning, Meaning::skip);
  EXPECT_EQ(fields[5].name, "battery");
  EXPECT_EQ(fields[5].meaning, Meaning::value);
  EXPECT_EQ(parsed.format.bits(), 43u);
  EXPECT_TRUE(parsed.format.gray());
}

TEST(WordFormat, ErrorsHaveThePlace) {
  struct Case {
    std::string_view text;
    std::size_t at;
    std::string_view words;
  };
  for (const Case& one : std::to_array<Case>({
           {"", 0, "needs a position"},
           {"error:1", 7, "needs a position"},
           {"position:24 psition:3", 12, "none of position"},
           {"position:24  flag=bit:3", 18, "none of position"},
           {"position", 8, "bits is missing"},
           {"position:", 9, "bits is missing"},
           {"position:!", 9, "bits is missing"},
           {"position:2x", 10, "only digits"},
           {"position:65", 9, "1 to 64"},
           {"position:99999999999999999999", 9, "1 to 64"},
           {"position:0", 0, "1 to 64"},
           {"position:24 error:2", 12, "have 1 bit"},
           {"position:24 position:3", 12, "one of this"},
           {"position:24 gray gray", 17, "one of this"},
           {"position:24 =value:3", 12, "name before ="},
           {"position:64 skip:64 skip:1", 20, "128 bits"},
           {"position:1 skip:1 skip:1 skip:1 skip:1 skip:1 skip:1 skip:1 skip:1 skip:1 skip:1 skip:1 skip:1", 88,
            "12 fields"},
           {"multiturn:12 position:60 gray", 0, "64 bits together"},
           {"multiturn:12 position:60", 0, "64 bits together"},
           {"position:24 a-b=value:3", 13, "only letters"},
           {"position:24 a_name_too_long_=value:3", 12, "at most 15"},
           {"position:24 value:3 value:3", 20, "two values have this name"},
           {"position:24 a=value:3 a=value:3", 22, "two values have this name"},
       })) {
    const Parsed parsed = parse(one.text);
    EXPECT_EQ(parsed.error.at, one.at) << one.text;
    EXPECT_NE(parsed.error.reason.find(one.words), std::string_view::npos) << one.text << ": " << parsed.error.reason;
    EXPECT_EQ(parsed.format.bits(), 0u) << "changed in spite of the error";
  }
}

Result<Word> decode(const WordFormat& format, Bytes bytes, std::size_t bits) {
  return decode_word(format, {bytes, bits});
}

TEST(Word, DecodesWhatEachFieldMeans) {
  // Multiturn 5, position 0x14, error bit 1, warning bit 1, two skipped bits, inverted value 3.
  constexpr std::array<std::uint8_t, 2> bytes{0b01011010, 0b01111100};
  constexpr WordFormat format = "multiturn:4 position:5 error:1! warning:1! skip:2 name=value:3!"_word;
  const Result<Word> word = decode(format, bytes, 16);
  ASSERT_TRUE(word);
  EXPECT_EQ(word->multiturn, 5u);
  EXPECT_EQ(word->position, 0b10100u);
  EXPECT_FALSE(word->error);  // the error bit is 1 and active low, so it reports no error
  EXPECT_FALSE(word->warning);
  EXPECT_EQ(word->values[5], 0b011u);
  EXPECT_EQ(decode(format, bytes, 15).error(), Error::wrong_length);
}

TEST(Word, GrayCodeSpansTurnsAndPosition) {
  constexpr WordFormat turns_first = "multiturn:4 position:13 gray"_word;
  constexpr WordFormat position_first = "position:13 error:1 multiturn:4 gray"_word;
  BitBuffer<64> bits;
  EXPECT_TRUE(encode_word(turns_first, {.position = 0x1234, .multiturn = 5}, bits));
  EXPECT_EQ(bits.view().load(0, 17), gray_encode(5u << 13 | 0x1234));
  bits.clear();
  EXPECT_TRUE(encode_word(position_first, {.position = 0x1234, .multiturn = 5, .error = true}, bits));
  EXPECT_EQ(bits.view().load(0, 13) << 4 | bits.view().load(14, 4), gray_encode(0x1234u << 4 | 5));
  EXPECT_EQ(decode_word(position_first, bits.view())->multiturn, 5u);
}

TEST(Word, ParityCoversAllBitsBeforeIt) {
  constexpr WordFormat even = "position:7 error:1 parity:1"_word;
  constexpr WordFormat odd = "position:7 error:1 parity:1! skip:3"_word;
  for (std::uint64_t position = 0; position < 128; ++position) {
    for (const bool error : {false, true}) {
      BitBuffer<64> bits;
      EXPECT_TRUE(encode_word(even, {.position = position, .error = error}, bits));
      EXPECT_FALSE(odd_parity(bits.view().load(0, 9)));
      EXPECT_EQ(decode_word(odd, BitView{bits.bytes(), 12}).error(), Error::bad_checksum);
      bits.clear();
      EXPECT_TRUE(encode_word(odd, {.position = position, .error = error}, bits));
      EXPECT_TRUE(odd_parity(bits.view().load(0, 9)));
      EXPECT_TRUE(decode_word(odd, bits.view()));
      EXPECT_EQ(decode_word(even, bits.view()).error(), Error::bad_checksum);
    }
  }
}

TEST(Word, ErrorBitMakesTheReadingInvalid) {
  constexpr WordFormat format = "multiturn:4 position:13 error:1 warning:1"_word;
  const Reading good = to_reading(format, {.position = 7, .multiturn = 3, .warning = true}, {});
  EXPECT_TRUE(good.singleturn_valid());
  EXPECT_TRUE(good.multiturn_valid);
  EXPECT_EQ(good.alarms, word_warning);
  const Reading bad = to_reading(format, {.position = 7, .multiturn = 3, .error = true}, {});
  EXPECT_FALSE(bad.singleturn_valid());
  EXPECT_FALSE(bad.multiturn_valid);
  EXPECT_EQ(bad.alarms, word_error);
  EXPECT_EQ(to_reading(format, {}, {true, 0.05}).unit_um, 0.05);
}

TEST(Word, ReportsTheAlarmsForWhichItHasABit) {
  const auto reported = [](const WordFormat& format) { return to_reading(format, {}, {}).alarms_reported; };
  EXPECT_EQ(reported("position:12"_word), 0u);
  EXPECT_EQ(reported("position:12 error:1"_word), word_error);
  EXPECT_EQ(reported("warning:1 position:12 skip:3"_word), word_warning);
  EXPECT_EQ(reported("position:12 error:1 warning:1 parity:1"_word), word_error | word_warning);
  EXPECT_EQ(to_reading("position:12"_word, {}, {}).singleturn_validity(), Validity::valid) << "nothing takes it away";
}

TEST(Word, AShaftIsShownWithAnyNumberOfBits) {
  const ShaftState state{.position = (std::int64_t{-3} << 32) + 0x8000'0001};
  EXPECT_EQ(word_of("multiturn:4 position:1"_word, state, 0), (Word{.position = 1, .multiturn = 13}));
  EXPECT_EQ(word_of("position:32"_word, state, 0).position, 0x8000'0001u);
  EXPECT_EQ(word_of("position:64"_word, state, 0).position, 0x8000'0001'0000'0000u);
  EXPECT_TRUE(word_of("position:8 error:1"_word, state, word_error).error);
}

TEST(Word, FieldsOfTheUserCarryTheirNames) {
  struct Collector final : FieldSink {
    void put(const FieldValue& value) override {
      text += std::string(value.info->name) + '=' + std::to_string(value.number) + ' ';
    }
    std::string text;
  } sink;
  put_word(sink, "position:8 battery=value:3 skip:1 error:1"_word, {.position = 9, .error = true, .values = {0, 5}},
           {});
  EXPECT_EQ(sink.text, "singleturn=9 angle_deg=0 battery=5 error=1 ");
}

}  // namespace
}  // namespace absenc
