// SPDX-License-Identifier: Apache-2.0
// Options and models of a unit as data, and their parsing.
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

/// Choices of an option that is true or false; the value is the index.
inline constexpr std::array<std::string_view, 2> boolean_choices{"false", "true"};

/// Choices of an option that states whether other encoders share the line. The function `tell_shared` replaces the
/// choice `auto`.
inline constexpr std::array<std::string_view, 3> sharing_choices{"auto", "true", "false"};
/// Values of an option with `sharing_choices`: unknown, shared, alone.
enum Sharing : std::int64_t { sharing_automatic, sharing_yes, sharing_no };

/// Description of an option of a unit: a number, or one of `choices` (the value is the index). With `decimals`, its
/// values are in units of the last decimal digit.
struct Option {
  std::string_view name;       ///< Name of the option.
  std::string_view meaning;    ///< Meaning of the option, with its unit of measure.
  std::int64_t default_value;  ///< Value if neither the user nor a model sets the option.
  std::int64_t minimum = 0;    ///< Lowest value, if the option is a number; `or_zero` may permit 0, too.
  std::int64_t maximum = 0;    ///< Highest value, if the option is a number.
  std::span<const std::string_view> choices{};  ///< Words for the values from 0 on; empty: the option is a number.
  bool probeable = false;                       ///< true: captured frames can show the value of the option
  unsigned decimals = 0;                        ///< Most digits after the decimal point that the user may write.
  bool describes_word = false;  ///< true: a word format replaces this option, so the two cannot be given together
  std::uint32_t step = 1;       ///< permitted numbers are `minimum` plus multiples of this step, and see `or_zero`
  Role role = Role::other;      ///< Role by which programs that do not know the unit find the option.
  bool in_hex = false;          ///< true: texts show the value in hexadecimal, as with FieldInfo::in_hex
  bool or_zero = false;         ///< true: 0 is permitted too, although it is below `minimum`
};

/// An option together with a value of it.
struct OptionValue {
  std::size_t option;  ///< index of the option in Unit::options
  std::int64_t value;  ///< The value of the option.
};

/// A model of encoder: a name for a set of option values.
struct Model {
  std::string_view name;                ///< Name of the model.
  std::string_view meaning;             ///< Description of the model, as a phrase.
  std::uint32_t maximum_rpm;            ///< fastest shaft for which a position is specified, in rpm; 0: none stated
  std::span<const OptionValue> values;  ///< Options that the model sets, with their values.
};

/// Greatest number of options of a unit.
inline constexpr std::size_t maximum_options = 68;

/// Name of the option that gives a word format, for units that take one.
inline constexpr std::string_view word_option_name = "word";

/// The values of all options of a unit, by the index of the option.
struct Options {
  std::array<std::int64_t, maximum_options> values{};  ///< Values in the order of the unit's options.
  /// Model that the user named, or the first that no setting contradicts; null: there is none, or `word` is set.
  const Model* model = nullptr;
  WordFormat word{};  ///< word format, which replaces the options that describe a word; empty: those options apply

  /// Returns whether the user gave a word format.
  [[nodiscard]] constexpr bool has_word() const { return word.bits() != 0; }
  /// Returns the value of an option, by its index.
  [[nodiscard]] constexpr std::int64_t operator[](std::size_t option) const { return values[option]; }
};

/// An option as the user wrote it.
struct OptionText {
  std::string_view name;   ///< Name of the option.
  std::string_view value;  ///< Value of the option, as the user wrote it.
};

/// Why options were refused, with the part of the user's text that is wrong.
struct OptionError {
  /// Reason of the refusal; `none`: the options were accepted.
  enum class Kind : std::uint8_t {
    none,
    unknown_model,
    unknown_option,
    bad_value,
    bad_word,           ///< the word format is invalid: the member `word` has the reason and the place
    beside_word,        ///< the option `text`, or a model ("model"), was given together with a word format
  } kind = Kind::none;  ///< Reason of the refusal.
  /// The name or value that is wrong, as the user wrote it. Kind::beside_word: the name of the option that cannot be
  /// given together with a word format, or `model`.
  std::string_view text{};
  const Option* option = nullptr;  ///< Kind::bad_value: the option for which `text` was given; else null.
  WordFormatError word{};          ///< Kind::bad_word: reason and place of the error in the word format.
};

struct Unit;

/// Computes the values of all options into `resolved`: settings override the model, and the model overrides the
/// defaults. Returns why that is impossible, or an error of kind `none`.
[[nodiscard]] OptionError resolve_options(const Unit& unit, std::string_view model,
                                          std::span<const OptionText> settings, Options& resolved);

/// Changes the value of each option with `sharing_choices` from `auto` to `true`: other encoders share the line.
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

/// Parses a decimal number of 0 or more, in units of the last digit: "0.05" with three decimals is 50. Error:
/// invalid_argument.
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

/// Parses the value of an option. Error: invalid_argument.
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
