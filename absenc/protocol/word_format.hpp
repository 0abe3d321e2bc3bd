// SPDX-License-Identifier: Apache-2.0
// A position word described as text, for encoders that have no unit of their own: its fields from the MSB on.
//
//   word    = item { " " item }
//   item    = [ name "=" ] meaning ":" bits [ "!" ]  |  "gray"
//   meaning = position | multiturn | error | warning | parity | value | skip
//   name    = 1 to 15 letters, digits and _
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
#include "absenc/protocol/field.hpp"

namespace absenc {

/// Meaning of a field of a position word.
enum class Meaning : std::uint8_t { position, multiturn, error, warning, parity, value, skip };

/// Names of the meanings as a format text has them, in the order of Meaning.
inline constexpr std::array<std::string_view, 7> meaning_names{"position", "multiturn", "error", "warning",
                                                               "parity",   "value",     "skip"};

/// A name of at most 15 characters, stored in the object itself.
class WordFieldName {
 public:
  static constexpr std::size_t capacity = 15;  ///< Greatest number of characters of a name.

  constexpr WordFieldName() = default;
  /// Stores a text, cut to `capacity` characters.
  constexpr WordFieldName(std::string_view text)
      : text_(copied(text)), size_(static_cast<std::uint8_t>(first_of(text, capacity).size())) {}
  /// Stores a name, cut to `capacity` characters.
  constexpr WordFieldName(const char* text) : WordFieldName(std::string_view(text)) {}

  /// Returns the name.
  constexpr operator std::string_view() const { return {text_.data(), size_}; }
  /// Returns whether the name `left` equals the text `right`.
  friend constexpr bool operator==(const WordFieldName& left, std::string_view right) {
    return std::string_view(left) == right;
  }

 private:
  static constexpr std::array<char, capacity> copied(std::string_view text) {
    std::array<char, capacity> characters{};
    for (std::size_t i = 0; i < capacity && i < text.size(); ++i) characters[i] = text[i];
    return characters;
  }

  std::array<char, capacity> text_{};
  std::uint8_t size_ = 0;
};

/// One field of a position word.
struct WordField {
  WordFieldName name{};             ///< name of the field: that of its meaning, unless the text gives another
  Meaning meaning = Meaning::skip;  ///< Meaning of the field.
  std::uint8_t bits = 0;            ///< number of bits of the field, 1 to 64; error, warning and parity have 1
  bool active_low = false;          ///< whether the field is sent inverted: a flag is set when 0, parity is odd
};

/// Error in the text of a word format; `reason` is empty if there is none.
struct WordFormatError {
  std::string_view reason{};  ///< Why the text is no word format; empty: it is one.
  /// index in the text of the error; if it is the length of the text, something is missing at the end
  std::size_t at = 0;
};

/// Format of a position word as data: its fields in order.
class WordFormat {
 public:
  static constexpr std::size_t maximum_fields = 12;  ///< Greatest number of fields of a word.
  static constexpr unsigned maximum_bits = 128;      ///< Greatest number of bits of a word.

  constexpr WordFormat() = default;

  /// Adds a field at the end. Returns why that is impossible, or "" if it was added.
  constexpr std::string_view add(const WordField& field) {
    const bool flag = field.meaning >= Meaning::error && field.meaning <= Meaning::parity;
    if (field.bits < 1 || field.bits > 64) return "a field has 1 to 64 bits";
    if (flag && field.bits != 1) return "error, warning and parity have 1 bit";
    if (field.meaning <= Meaning::parity && find(field.meaning) != nullptr) return "there is one of this already";
    if (field.meaning == Meaning::value && find_value(field.name))
      return "two values have this name: write NAME=value:8";
    if (size_ == maximum_fields) return "a word has at most 12 fields";
    if (field.bits > maximum_bits - bits_) return "a word has at most 128 bits";
    fields_[size_++] = field;
    bits_ += field.bits;
    return {};
  }
  /// Declares that turns and position are one Gray-coded number.
  constexpr void set_gray() { gray_ = true; }

  /// Returns the fields in the order of the wire.
  [[nodiscard]] constexpr std::span<const WordField> fields() const { return {fields_.data(), size_}; }
  /// Returns the number of bits of a word.
  [[nodiscard]] constexpr unsigned bits() const { return bits_; }
  /// Returns whether turns and position are one Gray-coded number.
  [[nodiscard]] constexpr bool gray() const { return gray_; }
  /// Returns the index in the word of the first bit of the field number `index`.
  [[nodiscard]] constexpr unsigned first_of(std::size_t index) const {
    unsigned first = 0;
    for (std::size_t i = 0; i < index; ++i) first += fields_[i].bits;
    return first;
  }

  /// Returns the first field with this meaning, or null.
  [[nodiscard]] constexpr const WordField* find(Meaning meaning) const {
    for (const WordField& field : fields()) {
      if (field.meaning == meaning) return &field;
    }
    return nullptr;
  }
  /// Returns the number of bits of the first field with this meaning; 0: the word has none.
  [[nodiscard]] constexpr unsigned bits_of(Meaning meaning) const {
    const WordField* field = find(meaning);
    return field == nullptr ? 0 : field->bits;
  }

 private:
  [[nodiscard]] constexpr bool find_value(std::string_view name) const {
    for (const WordField& field : fields()) {
      if (field.meaning == Meaning::value && field.name == name) return true;
    }
    return false;
  }

  // No padding between the members: clang 14 leaves constants with padding partly unset.
  std::array<WordField, maximum_fields> fields_{};
  std::uint32_t size_ = 0;
  unsigned bits_ = 0;
  bool gray_ = false;
  static_assert(sizeof(fields_) % alignof(decltype(size_)) == 0);
};

namespace detail {

constexpr WordFormatError check_name(std::string_view name) {
  if (name.empty()) return {"the name before = is missing", 0};
  if (name.size() > WordFieldName::capacity) return {"a name has at most 15 characters", 0};
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (!letter && c != '_' && (c < '0' || c > '9')) return {"a name has only letters, digits and _", i};
  }
  return {};
}

// Parses `item`, "[name=]meaning:bits[!]", into `field`.
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
  if (named) {
    const WordFormatError error = check_name(first_of(item, equals));
    if (!error.reason.empty()) return error;
  }

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
  field = {named ? first_of(item, equals) : word, static_cast<Meaning>(meaning), static_cast<std::uint8_t>(bits),
           active_low};
  return {};
}

constexpr bool is_taken(std::string_view name, std::span<const FieldInfo> taken) {
  for (const FieldInfo& info : taken) {
    if (info.name == name) return true;
  }
  return false;
}

}  // namespace detail

/// Parses the text of a word format into `format`, which stays unchanged on an error. Returns the error, with an empty
/// `reason` if there is none. A value must not have the name of one of the fields `taken`.
[[nodiscard]] constexpr WordFormatError parse_word_format(std::string_view text, WordFormat& format,
                                                          std::span<const FieldInfo> taken = {}) {
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
      if (field.meaning == Meaning::value && detail::is_taken(field.name, taken)) {
        return {"the protocol has a field of this name: give it another", at};
      }
      const std::string_view reason = parsed.add(field);
      if (!reason.empty()) return {reason, at};
    }
    at += item.size();
  }
  if (parsed.find(Meaning::position) == nullptr) return {"a word needs a position", text.size()};
  if (parsed.bits_of(Meaning::position) + parsed.bits_of(Meaning::multiturn) > 64) {
    return {"position and turns have at most 64 bits together", 0};
  }
  format = parsed;
  return {};
}

namespace detail {
// not constexpr, so that an invalid word format in a program is a compile error that names this function
void this_is_no_word_format();

consteval WordFormat word_format_or_stop(std::string_view text) {
  WordFormat format;
  if (!parse_word_format(text, format).reason.empty()) this_is_no_word_format();
  return format;
}
}  // namespace detail

/// Returns the word format of a literal such as "position:24"_word.
consteval WordFormat operator""_word(const char* text, std::size_t size) {
  return detail::word_format_or_stop({text, size});
}

}  // namespace absenc
