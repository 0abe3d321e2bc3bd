// SPDX-License-Identifier: Apache-2.0
// Settings of a unit as data: bits, checks, profiles. A model is a named set of option values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/core/result.hpp"
#include "absenc/core/text.hpp"
#include "absenc/protocol/role.hpp"
#include "absenc/protocol/word_format.hpp"

namespace absenc {

/// Words of options that are yes or no.
inline constexpr std::array<std::string_view, 2> boolean_choices{"false", "true"};

/// Choices of an option that states whether other encoders share the line. `auto` becomes true if the caller knows it
/// (`tell_shared`): from absenc.toml, an open link with several users, or a virtual line with several encoders.
inline constexpr std::array<std::string_view, 3> sharing_choices{"auto", "true", "false"};
/// Whether several encoders share the line.
enum Sharing : std::int64_t { sharing_automatic, sharing_yes, sharing_no };

/// A number in a range, or one of `choices` (the value is the index into it). With `decimals`, the user writes up to
/// that many decimal digits, and all values are in units of the last digit.
struct Option {
  std::string_view name;                        ///< Name of the option.
  std::string_view meaning;                     ///< Meaning of the option, with its unit.
  std::int64_t default_value;                   ///< Value if the address does not set it.
  std::int64_t minimum = 0;                     ///< Lowest value.
  std::int64_t maximum = 0;                     ///< Highest value.
  std::span<const std::string_view> choices{};  ///< Words for the values from 0; none: it is a number.
  bool probeable = false;                       ///< captured frames can show its value
  unsigned decimals = 0;                        ///< Number of decimal digits of the value.
  bool describes_word = false;  ///< a word format replaces this option: the two cannot be given together
  std::uint32_t step = 1;       ///< values are `minimum` and multiples of this step above it
  Role role = Role::other;      ///< Role by which generic programs find it.
  bool in_hex = false;          ///< texts show it in hexadecimal, as FieldInfo::in_hex
  bool or_zero = false;         ///< 0 is a value too, below the range
};

/// An option with its value.
struct OptionValue {
  std::size_t option;  ///< index into the unit's options
  std::int64_t value;  ///< The value.
};

/// A model of encoder: a name for values of options.
struct Model {
  std::string_view name;                ///< Name of the model.
  std::string_view meaning;             ///< The model, as a phrase.
  std::uint32_t maximum_rpm;            ///< fastest shaft for which a position is specified, in rpm
  std::span<const OptionValue> values;  ///< Options that it sets.
};

inline constexpr std::size_t maximum_options = 68;  ///< twelve of biss-chain, and seven for each of its eight words

/// Name of the option that gives a word format, for units that take one.
inline constexpr std::string_view word_option_name = "word";

/// The values of all options of a unit, by the index of the option.
struct Options {
  std::array<std::int64_t, maximum_options> values{};  ///< Values in the order of the unit's options.
  const Model* model = nullptr;                        ///< model with these values; null: none
  WordFormat word{};                                   ///< replaces the options that describe a word; empty: they apply

  /// Returns whether the user described the position word.
  [[nodiscard]] constexpr bool has_word() const { return word.bits() != 0; }
  /// Returns the value of an option, by its index.
  [[nodiscard]] constexpr std::int64_t operator[](std::size_t option) const { return values[option]; }
};

/// An option as the user wrote it.
struct OptionText {
  std::string_view name;   ///< Name of the option.
  std::string_view value;  ///< Its value, as written.
};

/// Why options were refused. `text`: the wrong name or value; `option`: the option that it was meant for.
struct OptionError {
  /// Error in a text of options.
  enum class Kind : std::uint8_t {
    none,
    unknown_model,
    unknown_option,
    bad_value,
    bad_word,                      ///< `word` has the reason and the place
    beside_word,                   ///< the option or model `text` cannot be given together with a word
  } kind = Kind::none;             ///< Kind of the error.
  std::string_view text{};         ///< The part of the text that is wrong.
  const Option* option = nullptr;  ///< The option; null: it is unknown.
  WordFormatError word{};          ///< Error of the position word.
};

struct Unit;

/// Resolves options from a model and single settings, which override it. Without a model name the first model that
/// agrees with all settings is used, so that the length of a position also selects its id; if none agrees, the unit's
/// defaults apply. With a word no model is used.
[[nodiscard]] OptionError resolve_options(const Unit& unit, std::string_view model,
                                          std::span<const OptionText> settings, Options& resolved);

/// States that other encoders share the line, for options that leave it open.
void tell_shared(const Unit& unit, Options& options);

/// Parses an integer, decimal or 0x hexadecimal, with an optional minus sign. Error: invalid_argument.
[[nodiscard]] constexpr Result<std::int64_t> parse_number(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  unsigned base = 10;
  if (text.starts_with("0x") || text.starts_with("0X")) {
    base = 16;
    text.remove_prefix(2);
  }
  if (text.empty()) return Error::invalid_argument;
  std::int64_t value = 0;
  for (const char c : text) {
    unsigned digit = base;
    if (c >= '0' && c <= '9') digit = static_cast<unsigned>(c - '0');
    if (c >= 'a' && c <= 'f') digit = static_cast<unsigned>(c - 'a' + 10);
    if (c >= 'A' && c <= 'F') digit = static_cast<unsigned>(c - 'A' + 10);
    if (digit >= base) return Error::invalid_argument;
    if (value > (INT64_MAX - digit) / base) return Error::invalid_argument;
    value = value * base + digit;
  }
  return negative ? -value : value;
}

/// Parses a decimal number of 0 or more with at most `decimals` decimal digits, in units of the last digit: "0.05" with
/// three decimals is 50. Error: invalid_argument.
[[nodiscard]] constexpr Result<std::int64_t> parse_decimal(std::string_view text, unsigned decimals) {
  const std::size_t point = index_of(text, '.');
  const std::string_view whole = first_of(text, point);
  std::string_view fraction = behind(text, point + 1);
  const bool misplaced = whole.starts_with('-') || (point < text.size() && fraction.empty());
  if (misplaced || fraction.size() > decimals || whole.starts_with("0x") || whole.starts_with("0X")) {
    return Error::invalid_argument;
  }
  const Result<std::int64_t> number = parse_number(whole);
  if (!number) return number;
  std::int64_t value = *number;
  for (; decimals > 0; --decimals) {
    const char c = fraction.empty() ? '0' : fraction[0];
    if (!fraction.empty()) fraction.remove_prefix(1);
    if (c < '0' || c > '9' || value > (INT64_MAX - 9) / 10) return Error::invalid_argument;
    value = value * 10 + (c - '0');
  }
  return value;
}

/// Parses the value of an option: a number, or one of its choices. Error: invalid_argument.
[[nodiscard]] constexpr Result<std::int64_t> parse_value(const Option& option, std::string_view text) {
  for (std::size_t i = 0; i < option.choices.size(); ++i) {
    if (option.choices[i] == text) return static_cast<std::int64_t>(i);
  }
  if (!option.choices.empty()) return Error::invalid_argument;
  const Result<std::int64_t> number = option.decimals > 0 ? parse_decimal(text, option.decimals) : parse_number(text);
  if (number && *number == 0 && option.or_zero) return number;
  if (!number || *number < option.minimum || *number > option.maximum) return Error::invalid_argument;
  if ((*number - option.minimum) % option.step != 0) return Error::invalid_argument;
  return number;
}

}  // namespace absenc
