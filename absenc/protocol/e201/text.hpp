// SPDX-License-Identifier: Apache-2.0
// Finds numbers and versions in reply texts of the E201-9S that no document describes.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "absenc/core/bytes.hpp"
#include "absenc/core/hex.hpp"
#include "absenc/core/result.hpp"

namespace absenc::e201 {

/// Frequencies of MA for M1 to M8, in kHz.
inline constexpr std::array<std::uint16_t, 8> clocks_khz{35, 70, 140, 280, 560, 1100, 2200, 4400};

inline constexpr char end_of_line = '\r';  ///< Last character of each reply text.
/// Text of a reply.
using Text = ByteBuffer<64>;

/// Returns the index after the first CR; 0 if the text has none.
[[nodiscard]] constexpr std::size_t end_of_first_line(Bytes text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == end_of_line) return i + 1;
  }
  return 0;
}

/// Returns the text without leading and trailing CR, LF, tabs and spaces.
[[nodiscard]] constexpr Bytes trimmed(Bytes text) {
  const auto blank = [](std::uint8_t c) { return c == ' ' || c == '\r' || c == '\n' || c == '\t'; };
  while (!text.empty() && blank(text.front())) text = text.subspan(1);
  while (!text.empty() && blank(text.back())) text = text.first(text.size() - 1);
  return text;
}

/// Returns whether a character is a decimal digit.
[[nodiscard]] constexpr bool is_digit(std::uint8_t c) { return c >= '0' && c <= '9'; }

namespace detail {

// Returns the number of at most 9 digits at index `at`, and moves `at` behind it.
constexpr unsigned number_at(Bytes text, std::size_t& at) {
  unsigned number = 0;
  for (unsigned digits = 0; at < text.size() && is_digit(text[at]) && digits < 9; ++at, ++digits) {
    number = number * 10 + static_cast<unsigned>(text[at] - '0');
  }
  return number;
}

constexpr bool skip_to_digit(Bytes text, std::size_t& at) {
  while (at < text.size() && !is_digit(text[at])) ++at;
  return at < text.size();
}

}  // namespace detail

/// Firmware version of the interface.
struct Version {
  unsigned major;  ///< Number before the point of the version: 1 of 1.16.
  unsigned minor;  ///< Number after the point of the version: 16 of 1.16.
};

/// Returns whether this firmware has the command `4` (E201-9S document: since 1.16).
[[nodiscard]] constexpr bool has_samples(Version version) {
  return version.major > 1 || (version.major == 1 && version.minor >= 16);
}

/// Returns the first two numbers in a text that are separated by a point.
[[nodiscard]] constexpr std::optional<Version> find_version(Bytes text) {
  for (std::size_t at = 0; detail::skip_to_digit(text, at);) {
    const unsigned major = detail::number_at(text, at);
    if (at + 1 >= text.size() || text[at] != '.' || !is_digit(text[at + 1])) continue;
    return Version{major, detail::number_at(text, ++at)};
  }
  return std::nullopt;
}

/// Returns the first number in a text, at most nine digits of it. Error: bad_framing.
[[nodiscard]] constexpr Result<std::int64_t> find_number(Bytes text) {
  std::size_t at = 0;
  if (!detail::skip_to_digit(text, at)) return Error::bad_framing;
  return detail::number_at(text, at);
}

/// Converts a clock number or a frequency in kHz to the clock number, 1 to 8; 0: neither.
[[nodiscard]] constexpr unsigned clock_of(std::int64_t number) {
  for (unsigned i = 0; i < clocks_khz.size(); ++i) {
    if (number == i + 1 || number == clocks_khz[i]) return i + 1;
  }
  return 0;
}

/// Returns the clock number, 1 to 8, in the reply to `m`. Error: bad_framing.
[[nodiscard]] constexpr Result<std::int64_t> find_clock(Bytes text) {
  const unsigned clock = clock_of(find_number(text).value_or(0));
  return clock != 0 ? Result(std::int64_t{clock}) : Error::bad_framing;
}

/// Returns the number in the reply to `?`: digits with an optional sign. Error: bad_framing.
[[nodiscard]] constexpr Result<std::int64_t> decode_number(Bytes text) {
  const bool negative = !text.empty() && text[0] == '-';
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text = text.subspan(1);
  if (text.empty() || text.size() > 20) return Error::bad_framing;
  std::uint64_t number = 0;
  for (const std::uint8_t c : text) {
    if (!is_digit(c)) return Error::bad_framing;
    const std::uint64_t digit = static_cast<std::uint64_t>(c - '0');
    if (number > (std::numeric_limits<std::uint64_t>::max() - digit) / 10) return Error::bad_framing;
    number = number * 10 + digit;
  }
  return static_cast<std::int64_t>(negative ? 0 - number : number);
}

/// Returns the first voltage (`symbol` V) or current (A) in a text, in mV or mA.
[[nodiscard]] constexpr std::optional<unsigned> find_milli(Bytes text, std::uint8_t symbol) {
  for (std::size_t at = 0; detail::skip_to_digit(text, at);) {
    std::uint64_t milli = std::uint64_t{detail::number_at(text, at)} * 1000;
    const bool has_point = at < text.size() && text[at] == '.';
    // the reply may have a decimal comma instead of a point
    const bool has_comma = at + 1 < text.size() && text[at] == ',' && is_digit(text[at + 1]);
    if (has_point || has_comma) {
      unsigned weight = 100;
      for (++at; at < text.size() && is_digit(text[at]); ++at, weight /= 10) {
        milli += weight * static_cast<unsigned>(text[at] - '0');
      }
    }
    std::size_t after = at;
    while (after < text.size() && text[after] == ' ') ++after;
    const bool thousandths = after + 1 < text.size() && text[after] == 'm' && text[after + 1] == symbol;
    const bool is_whole = after < text.size() && text[after] == symbol;
    if (thousandths) milli /= 1000;
    if (thousandths || is_whole) return static_cast<unsigned>(std::min<std::uint64_t>(milli, ~0U));
  }
  return std::nullopt;
}

/// Returns the number in the reply to `>`, hexadecimal digits. Error: bad_framing.
[[nodiscard]] constexpr Result<std::int64_t> decode_hexadecimal(Bytes text) {
  if (text.empty() || text.size() > 16) return Error::bad_framing;
  std::uint64_t number = 0;
  for (const std::uint8_t c : text) {
    const int digit = hex_digit(static_cast<char>(c));
    if (digit < 0) return Error::bad_framing;
    number = number << 4 | static_cast<std::uint64_t>(digit);
  }
  return static_cast<std::int64_t>(number);
}

}  // namespace absenc::e201
