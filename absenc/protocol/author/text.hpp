// SPDX-License-Identifier: Apache-2.0
// Parses the texts of test vectors and models at compile time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/core/hex.hpp"
#include "absenc/protocol/options.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::author {

/// A test vector as text: a frame with the fields, or the error, that decoding must give. Frames are hexadecimal; on
/// clocked links, and if Declaration::frames_are_texts, they are plain text.
struct VectorText {
  std::string_view id;       ///< Identifier of the vector, unique within the unit.
  std::string_view meaning;  ///< The case that the vector shows, as a phrase.
  std::string_view source;   ///< Source of the frame: a document, or "derived" and the like.
  std::string_view options;  ///< Options of the encoder, as `name=value` separated by blanks.
  std::string_view request;  ///< Bytes of the request in hexadecimal, or plain text; empty: none.
  std::string_view reply;    ///< Bytes of the reply in hexadecimal, or plain text; empty: none.
  /// Expected fields as `name=value` separated by blanks, or the name of the expected error. A text that looks like a
  /// number is quoted: `serial="0815"`.
  std::string_view fields;
};

/// Has no definition. A wrong text of a vector or model calls this function, and the compile error shows its name.
void fields_of_a_vector_are_name_equals_value_or_the_name_of_an_error();
/// Has no definition. A wrong text of a vector or model calls this function, and the compile error shows its name.
void a_frame_of_a_vector_is_hexadecimal_and_has_at_most_128_bytes();
/// Has no definition. A wrong text of a vector or model calls this function, and the compile error shows its name.
void open_bytes_of_a_frame_are_not_consecutive();
/// Has no definition. A wrong text of a vector or model calls this function, and the compile error shows its name.
void this_model_has_an_option_or_a_value_that_the_unit_does_not_have();

/// Calls `take(name, value)` for each "name=value" of `text`, until a call returns false. Returns true if no call
/// returned false and the whole text has this form.
template <class Take>
constexpr bool for_each_value(std::string_view text, Take&& take) {
  while (!text.empty()) {
    // without an equals sign `equals` is npos, and the check below then returns false
    const std::size_t equals = text.find('=');
    const std::size_t next = text.find('=', equals + 1);
    const std::size_t end = next == std::string_view::npos ? text.size() : text.rfind(' ', next);
    if (end < equals || end > text.size()) return false;
    if (!take(text.substr(0, equals), text.substr(equals + 1, end - equals - 1))) return false;
    text.remove_prefix(end < text.size() ? end + 1 : end);
  }
  return true;
}

/// Parses a decimal number with a point into `number`, and returns whether that worked.
constexpr bool to_real(std::string_view text, double& number) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  std::int64_t digits = 0;
  long double divisor = 0;  // power of ten by which the digits are divided; 0: no point yet
  for (const char c : text) {
    if (c == '.' && divisor == 0) {
      divisor = 1;
    } else if (c >= '0' && c <= '9') {
      digits = digits * 10 + (c - '0');
      divisor *= 10;
    } else {
      return false;
    }
  }
  if (divisor == 0) return false;
  // Divided as long double, because the digits may need more bits than a double has.
  number = static_cast<double>(static_cast<long double>(negative ? -digits : digits) / divisor);
  return true;
}

/// The parsed content of a VectorText. A text that cannot be parsed does not compile.
struct VectorParts {
  constexpr VectorParts() = default;
  /// Parses `text`. `frames_are_texts`: the frames are plain text, not hexadecimal.
  constexpr VectorParts(const VectorText& text, bool frames_are_texts) {
    append(request, open_request, text.request, frames_are_texts);
    append(reply, open_reply, text.reply, frames_are_texts);
    for (std::size_t i = 1; i < error_texts.size(); ++i) {
      if (error_texts[i].name == text.fields) error = static_cast<Error>(i);
    }
    if (error != Error::none) return;
    const bool good = for_each_value(text.fields, [&](std::string_view name, std::string_view value) {
      const bool is_quoted = value.size() >= 2 && value.starts_with('"') && value.ends_with('"');
      if (is_quoted) return fields.push_back({.field = name, .text = value.substr(1, value.size() - 2)});
      double real = 0;
      if (const auto number = parse_number(value)) return fields.push_back({.field = name, .number = *number});
      if (to_real(value, real)) return fields.push_back({.field = name, .real = real});
      return fields.push_back({.field = name, .text = value});
    });
    if (!good) fields_of_a_vector_are_name_equals_value_or_the_name_of_an_error();
  }

  ByteBuffer<128> request{};      ///< Bytes of the request.
  ByteBuffer<128> reply{};        ///< Bytes of the reply.
  Buffer<Expected, 24> fields{};  ///< Expected fields with their values.
  Error error = Error::none;      ///< Expected error; `Error::none`: fields are expected.
  /// Consecutive bytes of the request that the author of the vector left open, written as `..`.
  OpenBytes open_request{};
  OpenBytes open_reply{};  ///< Consecutive bytes of the reply that the author of the vector left open, written as `..`.

 private:
  static constexpr void leave_open(OpenBytes& open, std::size_t index) {
    if (open.count == 0) open.first = index;
    if (open.first + open.count++ != index) open_bytes_of_a_frame_are_not_consecutive();
  }
  static constexpr void append(ByteBuffer<128>& bytes, OpenBytes& open, std::string_view hex, bool is_text) {
    const bool is_bits = is_text && hex.find_first_not_of("01.") == std::string_view::npos;
    for (std::size_t i = 0; is_text && i < hex.size(); ++i) {
      if (is_bits && hex[i] == '.') leave_open(open, i);
      if (!bytes.push_back(static_cast<std::uint8_t>(hex[i]))) {
        a_frame_of_a_vector_is_hexadecimal_and_has_at_most_128_bytes();
      }
    }
    if (is_text) return;
    for (std::size_t i = 0; i < hex.size(); i += 2) {
      if (hex.substr(i, 2) == ".." && bytes.push_back(0)) {
        leave_open(open, i / 2);
        continue;
      }
      if (i + 1 == hex.size() || hex_digit(hex[i]) < 0 || hex_digit(hex[i + 1]) < 0 ||
          !bytes.push_back(static_cast<std::uint8_t>(hex_digit(hex[i]) << 4 | hex_digit(hex[i + 1])))) {
        a_frame_of_a_vector_is_hexadecimal_and_has_at_most_128_bytes();
      }
    }
  }
};

/// Storage for the frames and expected fields of all vectors of a unit.
template <std::size_t byte_count, std::size_t field_count>
struct AllParts {
  ByteBuffer<byte_count> bytes{};          ///< Bytes of all requests and replies, one after the other.
  Buffer<Expected, field_count> fields{};  ///< Expected fields of all vectors, one after the other.
};

}  // namespace absenc::author
