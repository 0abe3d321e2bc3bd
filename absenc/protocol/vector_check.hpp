// SPDX-License-Identifier: Apache-2.0
// Compares the decoded fields of a frame with those that its test vector expects.
#pragma once

#include <span>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/hex.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc {

/// A sink that compares delivered fields with expected values. Real numbers are equal if they differ by less than 1e-9.
struct VectorCheck final : FieldSink {
  /// Expects exactly the fields `wanted`.
  constexpr explicit VectorCheck(std::span<const Expected> wanted) : expected(wanted) {}
  /// Counts the delivered field, and counts it as a match if its value is expected.
  constexpr void put(const FieldValue& value) override {
    for (const Expected& one : expected) {
      const double difference = one.real - value.real;
      const bool near = difference < 1e-9 && difference > -1e-9;
      if (one.field == value.info->name && one.number == value.number && near && same(one.text, value.bytes)) ++matches;
    }
    ++count;
  }
  /// Returns whether `bytes` are the characters of `text`.
  [[nodiscard]] static constexpr bool same(std::string_view text, Bytes bytes) {
    if (text.size() != bytes.size()) return false;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      if (static_cast<std::uint8_t>(text[i]) != bytes[i]) return false;
    }
    return true;
  }
  /// Returns whether as many fields were delivered as expected, and each had its expected value.
  [[nodiscard]] constexpr bool all() const { return matches == expected.size() && count == expected.size(); }

  std::span<const Expected> expected;  ///< The expected fields with their values.
  std::size_t matches = 0;             ///< Number of delivered fields that have their expected value.
  std::size_t count = 0;               ///< Number of delivered fields, expected or not.
};

/// Returns the bits of a test vector's text for a clocked link, at most 256.
[[nodiscard]] constexpr BitBuffer<256> bits_of_text(Bytes text) {
  BitBuffer<256> bits;
  for (const std::uint8_t c : text) bits.append(c == '1' ? 1 : 0, 1);
  return bits;
}

/// Returns the CAN frame of a text such as "1ff:022b"; more than three digits: a 29-bit identifier.
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
