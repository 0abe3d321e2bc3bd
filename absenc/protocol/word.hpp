// SPDX-License-Identifier: Apache-2.0
// Decodes and encodes a position word by its WordFormat, and makes a reading of it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "absenc/core/angle.hpp"
#include "absenc/core/bit_view.hpp"
#include "absenc/core/gray.hpp"
#include "absenc/core/result.hpp"
#include "absenc/core/shaft.hpp"
#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/word_format.hpp"

namespace absenc {

/// The decoded values of a position word; values that the word does not carry are 0.
template <std::size_t size>
struct WordWith {
  static constexpr std::size_t capacity = size;  ///< Number of elements of `values`.
  std::uint64_t position = 0;                    ///< Position in counts: within the turn, or of a linear encoder.
  std::uint64_t multiturn = 0;                   ///< Number of turns.
  /// Whether the encoder reports an error, by the error bit or by another sign of its protocol.
  bool error = false;
  bool warning = false;  ///< Whether the warning bit reports a warning.
  /// Values of fields with Meaning::value, by the index of the field in the format.
  std::array<std::uint64_t, size> values{};

  /// Returns whether all values of two words are equal.
  friend constexpr bool operator==(const WordWith&, const WordWith&) = default;
};
/// The decoded values of a position word of any format.
using Word = WordWith<WordFormat::maximum_fields>;

/// Bit of Reading::alarms: the encoder reports an error (WordWith::error).
inline constexpr std::uint32_t word_error = 1;
inline constexpr std::uint32_t word_warning = 2;  ///< Bit of Reading::alarms: the warning bit of a word.

/// Descriptions of the alarms of a word, in the order of word_error and word_warning.
inline constexpr std::array<FlagInfo, 2> word_flags{{
    {"error", "the encoder says that its position is wrong", "see the encoder's manual: its status tells the cause"},
    {"warning", "the encoder works near its limits", "check distance, dirt, temperature and supply", true},
}};

/// Names and types of the values of a word that are shown as fields, and of its alarms.
struct WordValues {
  std::uint64_t multiturn;   ///< Number of turns.
  std::uint64_t singleturn;  ///< Position within the turn, in counts.
  double angle;              ///< Position within the turn, in degrees.
  std::uint64_t position;    ///< Position of a linear encoder, in counts.
  double position_um;        ///< Position of a linear encoder, in micrometres.
  double position_mm;        ///< Position of a linear encoder, in millimetres.
  bool error;                ///< Whether the encoder reports an error: WordWith::error.
  bool warning;              ///< Whether the warning bit reports a warning.
  /// Alarms of a reading; never delivered as a field.
  std::uint32_t alarms;
};

/// The fields of WordValues: names, units of measure and meanings.
inline constexpr auto word_fields = author::fields_of<WordValues>(
    author::field<&WordValues::multiturn>("multiturn", "revolutions", "turns", Role::turns),
    author::field<&WordValues::singleturn>("singleturn", "counts", "position within the turn", Role::position),
    author::field<&WordValues::angle>("angle_deg", "deg", "position within the turn", Role::of_position),
    author::field<&WordValues::position>("position", "counts", "position of a linear encoder", Role::position),
    author::field<&WordValues::position_um>("position_um", "um", "position of a linear encoder", Role::of_position),
    author::field<&WordValues::position_mm>("position_mm", "mm", "position of a linear encoder", Role::of_position),
    author::field<&WordValues::error>("error", "", "the encoder says that its position is wrong"),
    author::field<&WordValues::warning>("warning", "", "the encoder works near its limits"),
    author::field<&WordValues::alarms>("alarms", "error and warning", word_flags));

/// Kind of encoder and scale of its position.
struct Scale {
  bool linear = false;  ///< Whether the encoder is linear; false: rotary.
  double unit_um = 0;   ///< linear encoders: micrometres per count; 0: unknown
};

/// A field of a word format, with its place in the word.
struct PlacedField {
  std::size_t index;  ///< Index of the field in the format.
  unsigned first;     ///< Index of the field's first bit in the word.
  Meaning meaning;    ///< Meaning of the field.
  unsigned bits;      ///< Number of bits of the field, 1 to 64.
  bool active_low;    ///< whether the field is sent inverted: a flag is set when 0, parity is odd
};

/// A format that is known at run time, in the form that the functions for position words take.
template <class Format>
struct Given {
  static constexpr bool is_known = false;  ///< Whether the format is known at compile time.
  /// C++ type of the decoded values of the word.
  using Word = absenc::Word;
  const Format& format;    ///< Format of the encoder (frame layout, options), which contains the word format.
  const WordFormat& word;  ///< Format of the position word.

  /// Calls `use` with each field of the word, until a call returns false. Returns true if no call did.
  template <class Use>
  constexpr bool each(Use use) const {
    unsigned first = 0;
    for (std::size_t i = 0; i < word.fields().size(); ++i) {
      const WordField& field = word.fields()[i];
      if (!use(PlacedField{i, first, field.meaning, field.bits, field.active_low})) return false;
      first += field.bits;
    }
    return true;
  }
};

/// A format that is known at compile time, in the form that the functions for position words take.
template <const auto& known>
struct Known {
  static constexpr bool is_known = true;  ///< Whether the format is known at compile time.
  /// Format of the encoder (frame layout, options), which contains the word format.
  static constexpr const auto& format = known;
  static constexpr const WordFormat& word = known.word;      ///< Format of the position word.
  static constexpr std::size_t size = word.fields().size();  ///< Number of fields of the word.
  /// C++ type of the decoded values of the word.
  using Word = WordWith<word.find(Meaning::value) == nullptr ? 0 : size>;

  /// The field with the index `i` in the word format; its members are constants.
  template <std::size_t i>
  struct Field {
    static constexpr std::size_t index = i;                       ///< Index of the field in the format.
    static constexpr unsigned first = word.first_of(i);           ///< Index of the field's first bit in the word.
    static constexpr Meaning meaning = word.fields()[i].meaning;  ///< Meaning of the field.
    static constexpr unsigned bits = word.fields()[i].bits;       ///< Number of bits of the field, 1 to 64.
    /// Whether the field is sent inverted: a flag is set when 0, parity is odd.
    static constexpr bool active_low = word.fields()[i].active_low;
  };

  /// Calls `use` with each field of the word, until a call returns false. Returns true if no call did.
  template <class Use>
  static constexpr bool each(Use use) {
    return each(use, std::make_index_sequence<size>{});
  }

 private:
  template <class Use, std::size_t... i>
  static constexpr bool each(Use& use, std::index_sequence<i...>) {
    return (use(Field<i>{}) && ...);
  }
};

namespace detail {

template <class Bits>
constexpr bool parity_of(const Bits& bits, std::size_t first, std::size_t end) {
  bool odd = false;
  for (; first + 64 <= end; first += 64) odd ^= odd_parity(bits.load(first, 64));
  return odd ^ odd_parity(bits.load(first, static_cast<unsigned>(end - first)));
}

// Decodes or encodes a Gray-coded number whose bits are split into several fields.
class GrayFields {
 public:
  constexpr std::uint64_t decode(std::uint64_t gray, unsigned bits) {
    const std::uint64_t binary = gray_decode(gray) ^ (odd_ ? low_mask(bits) : 0);
    odd_ = (binary & 1) != 0;
    return binary;
  }
  constexpr std::uint64_t encode(std::uint64_t binary, unsigned bits) {
    const std::uint64_t gray = gray_encode(binary) ^ (odd_ ? std::uint64_t{1} << (bits - 1) : 0);
    odd_ = (binary & 1) != 0;
    return gray;
  }

 private:
  bool odd_ = false;
};

// The `count` bits of a frame from bit `first` on; the frame must have all of them.
class SomeBits {
 public:
  constexpr SomeBits(BitView bits, std::size_t first, unsigned count)
      : size(count), number_(count <= 64 ? bits.load(first, count) : 0), bits_(bits), first_(first) {}

  [[nodiscard, gnu::always_inline]] constexpr std::uint64_t load(std::size_t first, unsigned count) const {
    return size <= 64 ? BitNumber{number_, size}.load(first, count) : load_from(bits_, first_ + first, count);
  }

  const unsigned size;

 private:
  [[nodiscard, gnu::noinline]] static constexpr std::uint64_t load_from(const BitView& bits, std::size_t first,
                                                                        unsigned count) {
    return bits.load(first, count);
  }

  std::uint64_t number_;
  BitView bits_;
  std::size_t first_;
};

// Decodes the word at bit `first` of `bits`. Returns wrong_length, bad_checksum, or none.
template <class Source, class Bits>
constexpr Error take_word(const Source& source, const Bits& bits, std::size_t first, typename Source::Word& word) {
  if (bits.size < first || bits.size - first < source.word.bits()) return Error::wrong_length;
  GrayFields gray;
  const bool holds = source.each([&](auto field) {
    std::uint64_t value = bits.load(first + field.first, field.bits);
    if (field.active_low) value ^= low_mask(field.bits);
    const bool counts = field.meaning == Meaning::position || field.meaning == Meaning::multiturn;
    if (counts && source.word.gray()) value = gray.decode(value, field.bits);
    if (field.meaning == Meaning::position) word.position = value;
    if (field.meaning == Meaning::multiturn) word.multiturn = value;
    if (field.meaning == Meaning::error) word.error = value != 0;
    if (field.meaning == Meaning::warning) word.warning = value != 0;
    if constexpr (Source::Word::capacity != 0) {
      if (field.meaning == Meaning::value) word.values[field.index] = value;
    }
    return field.meaning != Meaning::parity || (value != 0) == parity_of(bits, first, first + field.first);
  });
  return holds ? Error::none : Error::bad_checksum;
}

}  // namespace detail

/// Decodes the word that begins at bit `first` of `bits`. Errors: wrong_length, bad_checksum.
[[nodiscard]] constexpr Result<Word> decode_word(const WordFormat& format, BitView bits, std::size_t first = 0) {
  Word word;
  const Error error = detail::take_word(Given<WordFormat>{format, format}, bits, first, word);
  return error == Error::none ? Result(word) : error;
}

/// Appends the encoded word to `out`. Returns false, without a change, if `out` is too small.
template <std::size_t Capacity>
constexpr bool encode_word(const WordFormat& format, const Word& word, BitBuffer<Capacity>& out) {
  if (out.capacity() - out.size() < format.bits()) return false;
  detail::GrayFields gray;
  const std::size_t first = out.size();
  for (std::size_t i = 0; i < format.fields().size(); ++i) {
    const WordField& field = format.fields()[i];
    std::uint64_t value = 0;
    const bool counts = field.meaning == Meaning::position || field.meaning == Meaning::multiturn;
    if (counts) value = (field.meaning == Meaning::position ? word.position : word.multiturn) & low_mask(field.bits);
    if (counts && format.gray()) value = gray.encode(value, field.bits);
    if (field.meaning == Meaning::error) value = word.error ? 1 : 0;
    if (field.meaning == Meaning::warning) value = word.warning ? 1 : 0;
    if (field.meaning == Meaning::parity) value = detail::parity_of(out.view(), first, out.size()) ? 1 : 0;
    if (field.meaning == Meaning::value) value = word.values[i];
    if (field.active_low && field.meaning != Meaning::skip) value ^= low_mask(field.bits);
    out.append(value, field.bits);
  }
  return true;
}

/// Puts the values of the word into `sink`, in the order of the wire; none for skip and parity.
constexpr void put_word(FieldSink& sink, const WordFormat& format, const Word& word, const Scale& scale) {
  for (std::size_t i = 0; i < format.fields().size(); ++i) {
    const WordField& field = format.fields()[i];
    if (field.meaning == Meaning::position && scale.linear) {
      const double um = micrometres(word.position, scale.unit_um);
      word_fields.put<&WordValues::position>(sink, word.position);
      if (scale.unit_um > 0) word_fields.put<&WordValues::position_um>(sink, um);
      if (scale.unit_um > 0) word_fields.put<&WordValues::position_mm>(sink, um / 1000);
    } else if (field.meaning == Meaning::position) {
      word_fields.put<&WordValues::singleturn>(sink, word.position);
      word_fields.put<&WordValues::angle>(sink, degrees(word.position, field.bits));
    } else if (field.meaning == Meaning::multiturn) {
      word_fields.put<&WordValues::multiturn>(sink, word.multiturn);
    } else if (field.meaning == Meaning::error) {
      word_fields.put<&WordValues::error>(sink, word.error);
    } else if (field.meaning == Meaning::warning) {
      word_fields.put<&WordValues::warning>(sink, word.warning);
    } else if (field.meaning == Meaning::value) {
      const FieldInfo info{field.name, FieldInfo::Kind::counts, "", "a field of the word format"};
      sink.put({&info, static_cast<std::int64_t>(word.values[i])});
    }
  }
}

/// Numbers of bits of position and turns in a word, and which of the two comes first.
struct PositionBits {
  unsigned position;            ///< Number of bits of the position.
  unsigned multiturn = 0;       ///< Number of bits of the turns; 0: none.
  bool multiturn_first = true;  ///< Whether the turns precede the position.
};

/// Properties of a word format that are needed to make a reading of a word.
struct WordContents {
  PositionBits bits{};         ///< Numbers of bits of position and turns.
  std::uint32_t reported = 0;  ///< alarms (word_error, word_warning) for which the word has a bit
};
/// Returns the numbers of bits of position and turns, and the alarms that a word can report.
[[nodiscard]] constexpr WordContents contents_of(const WordFormat& format) {
  WordContents contents;
  for (const WordField& field : format.fields()) {
    if (field.meaning == Meaning::position) contents.bits.position = field.bits;
    if (field.meaning == Meaning::multiturn) contents.bits.multiturn = field.bits;
    if (field.meaning == Meaning::error) contents.reported |= word_error;
    if (field.meaning == Meaning::warning) contents.reported |= word_warning;
  }
  return contents;
}

/// Returns the reading of a word. `word.error` makes position and turns invalid.
template <std::size_t size>
[[nodiscard]] constexpr Reading to_reading(const WordContents& contents, const WordWith<size>& word,
                                           const Scale& scale) {
  return {.singleturn = word.position,
          .multiturn = word.multiturn,
          .singleturn_bits = contents.bits.position,
          .multiturn_bits = contents.bits.multiturn,
          .singleturn_valid_bits = word.error ? 0 : contents.bits.position,
          .multiturn_valid = !word.error && contents.bits.multiturn != 0,
          .unit_um = scale.linear ? scale.unit_um : 0,
          .alarms = (word.error ? word_error : 0) | (word.warning ? word_warning : 0),
          .alarms_reported = contents.reported};
}
/// Returns the reading of a word with this format.
[[nodiscard]] constexpr Reading to_reading(const WordFormat& format, const Word& word, const Scale& scale) {
  return to_reading(contents_of(format), word, scale);
}

/// Puts the fields of the word, and then its reading, into `sink`.
constexpr void put_position(FieldSink& sink, const WordFormat& format, const Word& word, const Scale& scale) {
  put_word(sink, format, word, scale);
  sink.put_reading(to_reading(format, word, scale));
}

/// Returns the values that a virtual encoder sends in its word. A linear encoder moves over its whole range in one
/// revolution.
[[nodiscard]] constexpr Word word_of(const WordFormat& format, const ShaftState& state, std::uint32_t alarms) {
  const unsigned bits = format.bits_of(Meaning::position);
  const auto fraction = static_cast<std::uint64_t>(state.position);
  Word word;
  word.position = (bits <= 32 ? (fraction & 0xFFFF'FFFF) >> (32 - bits) : fraction << (bits - 32)) & low_mask(bits);
  word.multiturn = static_cast<std::uint64_t>(state.position >> 32) & low_mask(format.bits_of(Meaning::multiturn));
  word.error = (alarms & word_error) != 0;
  word.warning = (alarms & word_warning) != 0;
  return word;
}

/// Returns the format of a word with position and turns. Position or turns are left out if they have 0 or more than 64
/// bits.
[[nodiscard]] constexpr WordFormat word_format(const PositionBits& bits) {
  WordFormat format;
  const auto bits_of = [](unsigned count) { return static_cast<std::uint8_t>(count <= 64 ? count : 0); };
  const WordField turns{"multiturn", Meaning::multiturn, bits_of(bits.multiturn)};
  // position or turns of 0 bits are left out, because `add` refuses a field of 0 bits
  if (bits.multiturn_first) format.add(turns);
  format.add({"position", Meaning::position, bits_of(bits.position)});
  if (!bits.multiturn_first) format.add(turns);
  return format;
}

}  // namespace absenc
