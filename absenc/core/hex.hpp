// SPDX-License-Identifier: Apache-2.0
// Bytes written as hexadecimal text, at compile time (`hex<"1A 00">`) and at run time.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/core/result.hpp"

namespace absenc {

/// Returns the value of a hexadecimal digit, 0 to 15, or -1 for another character.
[[nodiscard]] constexpr int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// Parses pairs of hexadecimal digits, with spaces between pairs allowed, into `bytes`. Returns the number of bytes.
/// Errors: invalid_argument, buffer_too_small.
[[nodiscard]] constexpr Result<std::size_t> parse_hex(std::string_view text, MutableBytes bytes) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] == ' ') {
      ++i;
      continue;
    }
    const int high = hex_digit(text[i]);
    const int low = i + 1 < text.size() ? hex_digit(text[i + 1]) : -1;
    if (high < 0 || low < 0) return Error::invalid_argument;
    if (count == bytes.size()) return Error::buffer_too_small;
    bytes[count++] = static_cast<std::uint8_t>(high << 4 | low);
    i += 2;
  }
  return count;
}

/// A string literal that can be a template argument.
template <std::size_t size>
struct HexLiteral {
  /// Copies the string literal `text`.
  consteval HexLiteral(const char (&text)[size]) { std::copy_n(text, size, characters); }
  /// Returns the characters of the literal without the terminating zero.
  [[nodiscard]] constexpr std::string_view view() const { return {characters, size - 1}; }
  char characters[size]{};  ///< Characters of the literal, with the terminating zero.
};

namespace detail {
inline constexpr std::size_t most_hex_bytes = 256;

template <HexLiteral literal>
consteval bool is_hex() {
  std::array<std::uint8_t, most_hex_bytes> buffer{};
  return parse_hex(literal.view(), buffer).has_value();
}

template <HexLiteral literal>
consteval auto hex_bytes() {
  constexpr std::size_t count = [] {
    std::array<std::uint8_t, most_hex_bytes> buffer{};
    return parse_hex(literal.view(), buffer).value();
  }();
  std::array<std::uint8_t, count> bytes{};
  static_cast<void>(parse_hex(literal.view(), bytes));
  return bytes;
}
}  // namespace detail

/// Bytes, at most 256, of a literal of hexadecimal text: `hex<"1A 00">` has two bytes. Text that is not hexadecimal
/// does not compile.
template <HexLiteral literal>
requires(detail::is_hex<literal>()) inline constexpr auto hex = detail::hex_bytes<literal>();

}  // namespace absenc
