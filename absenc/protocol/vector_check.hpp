// SPDX-License-Identifier: Apache-2.0
// Compares the decoded fields of a frame with those that its vector expects, also at compile time.
#pragma once

#include <span>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/hex.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc {

/// A sink that expects every put field, in any order; real numbers to 1e-9.
struct VectorCheck final : FieldSink {
  /// Compares with these values.
  constexpr explicit VectorCheck(std::span<const Expected> wanted) : expected(wanted) {}
  /// Compares the value of a field, if it is expected.
  constexpr void put(const FieldValue& value) override {
    for (const Expected& one : expected) {
      const double difference = one.real - value.real;
      const bool near = difference < 1e-9 && difference > -1e-9;
      if (one.field == value.info->name && one.number == value.number && near && same(one.text, value.bytes)) ++matches;
    }
    ++count;
  }
  /// Returns whether `bytes` are those of the hexadecimal `text`.
  [[nodiscard]] static constexpr bool same(std::string_view text, Bytes bytes) {
    if (text.size() != bytes.size()) return false;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      if (static_cast<std::uint8_t>(text[i]) != bytes[i]) return false;
    }
    return true;
  }
  /// Returns whether each expected field was put once, with its value.
  [[nodiscard]] constexpr bool all() const { return matches == expected.size() && count == expected.size(); }

  std::span<const Expected> expected;  ///< The wanted values.
  std::size_t matches = 0;             ///< Number of fields with the wanted value.
  std::size_t count = 0;               ///< Number of expected fields that were put.
};

/// Returns the frame of a vector's text on a clocked link: at most 256 bits, every character but 1 is 0.
[[nodiscard]] constexpr BitBuffer<256> bits_of_text(Bytes text) {
  BitBuffer<256> bits;
  for (const std::uint8_t c : text) bits.append(c == '1' ? 1 : 0, 1);
  return bits;
}

/// Returns the frame of a vector's text on a CAN link: "1ff:022b"; an identifier of more than three digits has 29 bits.
/// Any other text gives an empty frame.
[[nodiscard]] constexpr CanFrame can_frame_of_text(Bytes text) {
  CanFrame frame;
  std::size_t at = 0;
  for (; at < text.size() && text[at] != ':'; ++at) {
    frame.id = frame.id << 4 | static_cast<std::uint32_t>(hex_digit(static_cast<char>(text[at])) & 15);
  }
  frame.extended = at > 3;
  for (++at; at + 1 < text.size() && frame.size < frame.data.size(); at += 2) {
    frame.data[frame.size++] = static_cast<std::uint8_t>(hex_digit(static_cast<char>(text[at])) << 4 |
                                                         hex_digit(static_cast<char>(text[at + 1])));
  }
  return frame;
}

}  // namespace absenc
