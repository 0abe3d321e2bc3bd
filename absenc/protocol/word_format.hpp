// SPDX-License-Identifier: Apache-2.0
// A position word described as text, for encoders that nobody has a driver for: the fields from its MSB on.
//
//   word    = item { " " item }
//   item    = [ name "=" ] meaning ":" bits [ "!" ]  |  "gray"
//   meaning = position | multiturn | error | warning | parity | value | skip
//
// `!` is active low. `gray`: multiturn and position, in the order of the wire, are one Gray-coded number. `parity` is
// even over all bits before it, with `!` odd. `value` is any other number; `skip` carries nothing and is sent as 0.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/core/text.hpp"

namespace absenc {

enum class Meaning : std::uint8_t { position, multiturn, error, warning, parity, value, skip };

inline constexpr std::array<std::string_view, 7> meaning_names{"position", "multiturn", "error", "warning",
                                                               "parity",   "value",     "skip"};

struct WordField {
  std::string_view name;  // that of the meaning unless another was given; views the text it was parsed from
  Meaning meaning;
  unsigned bits;  // 1 to 64; error, warning and parity have 1
  bool active_low = false;
};

/// Where a text is no word: `reason` is empty when it is one.
struct WordFormatError {
  std::string_view reason{};
  std::size_t at = 0;  // index into the text
};

class WordFormat {
 public:
  static constexpr std::size_t maximum_fields = 12;
  static constexpr unsigned maximum_bits = 128;

  constexpr WordFormat() = default;

  /// Why the field cannot follow those before it, or empty.
  constexpr std::string_view add(const WordField& field) {
    const bool flag = field.meaning >= Meaning::error && field.meaning <= Meaning::parity;
    if (field.bits < 1 || field.bits > 64) return "a field has 1 to 64 bits";
    if (flag && field.bits != 1) return "error, warning and parity have 1 bit";
    if (field.meaning <= Meaning::parity && find(field.meaning) != nullptr) return "there is one of this already";
    if (size_ == maximum_fields) return "a word has at most 12 fields";
    if (field.bits > maximum_bits - bits_) return "a word has at most 128 bits";
    fields_[size_++] = field;
    bits_ += field.bits;
    return {};
  }
  constexpr void set_gray() { gray_ = true; }

  [[nodiscard]] constexpr std::span<const WordField> fields() const { return {fields_.data(), size_}; }
  [[nodiscard]] constexpr unsigned bits() const { return bits_; }
  [[nodiscard]] constexpr bool gray() const { return gray_; }

  /// Null when the word has none.
  [[nodiscard]] constexpr const WordField* find(Meaning meaning) const {
    for (const WordField& field : fields()) {
      if (field.meaning == meaning) return &field;
    }
    return nullptr;
  }
  /// 0 when the word has none.
  [[nodiscard]] constexpr unsigned bits_of(Meaning meaning) const {
    const WordField* field = find(meaning);
    return field == nullptr ? 0 : field->bits;
  }

 private:
  std::array<WordField, maximum_fields> fields_{};
  std::size_t size_ = 0;
  unsigned bits_ = 0;
  bool gray_ = false;
};

namespace detail {

// [name=]meaning:bits[!], without spaces. `at` of the error is relative to the item.
constexpr WordFormatError parse_word_field(std::string_view item, WordField& field) {
  const std::size_t equals = index_of(item, '=');
  const bool named = equals < item.size();
  const std::size_t begin = named ? equals + 1 : 0;
  const std::string_view rest = behind(item, begin);
  const std::size_t colon = index_of(rest, ':');
  const std::string_view word = first_of(rest, colon);
  std::size_t meaning = 0;
  while (meaning < meaning_names.size() && meaning_names[meaning] != word) ++meaning;
  if (meaning == meaning_names.size()) {
    return {"this is none of position, multiturn, error, warning, parity, value, skip, gray", begin};
  }
  if (colon == rest.size()) return {"the number of bits is missing, as in position:24", item.size()};
  if (equals == 0) return {"the name before = is missing", 0};

  std::string_view number = behind(rest, colon + 1);
  const bool active_low = number.ends_with('!');
  if (active_low) number.remove_suffix(1);
  const std::size_t number_at = begin + colon + 1;
  if (number.empty()) return {"the number of bits is missing, as in position:24", number_at};
  unsigned bits = 0;
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (number[i] < '0' || number[i] > '9') return {"the number of bits has only digits", number_at + i};
    bits = bits * 10 + static_cast<unsigned>(number[i] - '0');
    if (bits > 64) return {"a field has 1 to 64 bits", number_at};
  }
  field = {named ? first_of(item, equals) : word, static_cast<Meaning>(meaning), bits, active_low};
  return {};
}

}  // namespace detail

/// `format` is only changed when there is no error. Its names view `text`, which must live as long.
[[nodiscard]] constexpr WordFormatError parse_word_format(std::string_view text, WordFormat& format) {
  WordFormat parsed;
  std::size_t at = 0;
  while (at < text.size()) {
    if (text[at] == ' ') {
      ++at;
      continue;
    }
    const std::string_view rest = behind(text, at);
    const std::string_view item = first_of(rest, index_of(rest, ' '));
    if (item == "gray") {
      if (parsed.gray()) return {"there is one of this already", at};
      parsed.set_gray();
    } else {
      WordField field{};
      const WordFormatError error = detail::parse_word_field(item, field);
      if (!error.reason.empty()) return {error.reason, at + error.at};
      const std::string_view reason = parsed.add(field);
      if (!reason.empty()) return {reason, at};
    }
    at += item.size();
  }
  if (parsed.find(Meaning::position) == nullptr) return {"a word needs a position", text.size()};
  if (parsed.gray() && parsed.bits_of(Meaning::position) + parsed.bits_of(Meaning::multiturn) > 64) {
    return {"a Gray-coded number has at most 64 bits", 0};
  }
  format = parsed;
  return {};
}

namespace detail {
void this_is_no_word_format();  // not constexpr: a call of it does not compile

consteval WordFormat word_format_or_stop(std::string_view text) {
  WordFormat format;
  if (!parse_word_format(text, format).reason.empty()) this_is_no_word_format();
  return format;
}
}  // namespace detail

/// One that is known when the program is written: a mistake does not compile.
consteval WordFormat operator""_word(const char* text, std::size_t size) {
  return detail::word_format_or_stop({text, size});
}

}  // namespace absenc
