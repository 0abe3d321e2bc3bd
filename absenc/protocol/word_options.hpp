// SPDX-License-Identifier: Apache-2.0
// Options and models that the units of clocked encoders with position words share.
#pragma once

#include <array>

#include "absenc/protocol/author/option.hpp"
#include "absenc/protocol/unit.hpp"
#include "absenc/protocol/word.hpp"

namespace absenc {

/// Option: number of bits of the single-turn position.
inline constexpr Option singleturn_bits_option{.name = "singleturn_bits",
                                               .meaning = "bits of the position within the turn; 0: linear encoder",
                                               .default_value = 19,
                                               .minimum = 0,
                                               .maximum = 64,
                                               .probeable = true,
                                               .describes_word = true};
inline constexpr Option multiturn_bits_option{.name = "multiturn_bits",  ///< Option: number of bits of the turns.
                                              .meaning = "bits of the turns; 0: no turns",
                                              .default_value = 0,
                                              .minimum = 0,
                                              .maximum = 63,
                                              .probeable = true,
                                              .describes_word = true};
/// Option: whether the turns precede the position.
inline constexpr Option multiturn_first_option{.name = "multiturn_first",
                                               .meaning = "whether the turns come before the position",
                                               .default_value = 1,
                                               .choices = boolean_choices,
                                               .describes_word = true};
/// Option: number of bits of the position of a linear encoder.
inline constexpr Option position_bits_option{.name = "position_bits",
                                             .meaning = "linear encoders: bits of the position; 0: rotary encoder",
                                             .default_value = 0,
                                             .minimum = 0,
                                             .maximum = 64,
                                             .probeable = true,
                                             .describes_word = true};
inline constexpr Option unit_um_option{.name = "unit_um",  ///< Option: micrometres per count of a linear encoder.
                                       .meaning = "linear encoders: micrometres a count",
                                       .default_value = 0,
                                       .minimum = 0,
                                       .maximum = 1'000'000'000'000,
                                       .decimals = 6};

/// Choices of the option `after_word`, in the order of ssi::AfterWord.
inline constexpr std::array<std::string_view, 4> after_word_choices{"repeat", "zero", "one", "separated"};
/// Option: what an SSI encoder sends when the host clocks beyond the end of the word.
inline constexpr Option after_word_option{.name = "after_word",
                                          .meaning = "what an SSI encoder sends when it is clocked on",
                                          .default_value = 0,
                                          .choices = after_word_choices};

/// The format of a protocol (its struct Format), together with the options that describe the position word.
template <class Format>
struct WordSettings : Format {
  std::uint8_t singleturn_bits = 0;  ///< Number of bits of the single-turn position; 0: linear encoder.
  std::uint8_t multiturn_bits = 0;   ///< Number of bits of the turns; 0: none.
  bool multiturn_first = true;       ///< Whether the turns precede the position.
  std::uint8_t position_bits = 0;    ///< Number of bits of a linear position; 0: rotary encoder.
  std::int64_t unit_pm = 0;          ///< Picometres per count of a linear encoder; 0: not given.

  /// Returns the numbers of bits of position and turns, and their order.
  [[nodiscard]] constexpr PositionBits bits() const {
    if (position_bits != 0) return {.position = position_bits};
    return {singleturn_bits, multiturn_bits, multiturn_first};
  }
  /// Returns the format of the protocol, with the position word that the user gave in `values`, or else the word
  /// `described`. `linear`: whether `described` is the word of a linear encoder.
  [[nodiscard]] constexpr Format with_word(const Options& values, const WordFormat& described, bool linear) const {
    Format format = *this;
    format.word = values.has_word() ? values.word : described;
    format.scale = {.linear = values.has_word() ? unit_pm != 0 : linear, .unit_um = static_cast<double>(unit_pm) / 1e6};
    return format;
  }
};

/// Returns whether a word has a position, and position and turns have at most 64 bits together.
[[nodiscard]] constexpr bool is_usable(const WordFormat& word) {
  const unsigned position = word.bits_of(Meaning::position);
  return position > 0 && position + word.bits_of(Meaning::multiturn) <= 64;
}
/// Returns whether a position can be shown as an angle or a distance.
[[nodiscard]] constexpr bool is_usable(const Scale& scale) { return !scale.linear || scale.unit_um > 0; }

/// Returns the resolution of an encoder with this word and scale.
[[nodiscard]] constexpr Resolution resolution_of(const WordFormat& word, const Scale& scale) {
  return {word.bits_of(Meaning::position), word.bits_of(Meaning::multiturn), scale.linear ? scale.unit_um : 0};
}

/// Returns the bits that carry `field` in a word that begins at bit `first`; may be none.
[[nodiscard]] constexpr BitRanges place_in_word(const WordFormat& format, const FieldInfo& field, std::size_t first) {
  // Fields are compared by name, because stored frames have copies of the field descriptions.
  const auto is = [&field](const FieldInfo* shown) { return field.name == shown->name; };
  const auto shows = [&](const WordField& one) {
    switch (one.meaning) {
      case Meaning::position:
        return !format.gray() &&
               (is(word_fields.of<&WordValues::singleturn>()) || is(word_fields.of<&WordValues::position>()));
      case Meaning::multiturn:
        return !format.gray() && is(word_fields.of<&WordValues::multiturn>());
      case Meaning::error:
        return is(word_fields.of<&WordValues::error>());
      case Meaning::warning:
        return is(word_fields.of<&WordValues::warning>());
      case Meaning::value:
        return field.name == one.name;
      default:
        return false;
    }
  };
  BitRanges ranges;
  for (const WordField& one : format.fields()) {
    if (ranges.empty() && shows(one)) ranges.push_back({first, one.bits, one.active_low});
    first += one.bits;
  }
  return ranges;
}

/// Models: the four examples in RLS "E201-9S Decoding the BiSS information", which states no greatest speeds.
inline constexpr std::array position_models{
    author::ModelText{"rotary-19", "single-turn, 19 bits (example 4)", 0,
                      "singleturn_bits=19 multiturn_bits=0 position_bits=0"},
    author::ModelText{"rotary-19-16", "19 bits, 65536 turns (example 3)", 0,
                      "singleturn_bits=19 multiturn_bits=16 position_bits=0"},
    author::ModelText{"linear-26-1um", "linear, 26 bits of 1 um (example 2)", 0,
                      "singleturn_bits=0 multiturn_bits=0 position_bits=26 unit_um=1"},
    author::ModelText{"linear-32-0.05um", "linear, 32 bits of 0.05 um (example 1)", 0,
                      "singleturn_bits=0 multiturn_bits=0 position_bits=32 unit_um=0.05"},
};

}  // namespace absenc
