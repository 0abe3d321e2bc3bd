// SPDX-License-Identifier: Apache-2.0
// SSI words with their source. Each is decoded at compile time: a broken frame does not build.
#pragma once

#include <array>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/ssi/fields.hpp"
#include "absenc/protocol/vector_check.hpp"

namespace absenc::ssi {

namespace expected {
inline constexpr std::array<Expected, 2> seed{{{"singleturn", 495}, {"angle_deg", 0, 43.505859375}}};
inline constexpr std::array<Expected, 2> zero{{{"singleturn", 0}, {"angle_deg", 0, 0}}};
inline constexpr std::array<Expected, 3> gray_turns{
    {{"multiturn", 5}, {"singleturn", 0x1234}, {"angle_deg", 0, 204.78515625}}};
inline constexpr std::array<Expected, 3> with_error{
    {{"singleturn", 0x1234}, {"angle_deg", 0, 204.78515625}, {"error", 1}}};
}  // namespace expected

// clang-format off
inline constexpr std::array<Vector, 15> vectors{{
    {"ssi-001", "12 bits", "RAA38S6 manual 3.5", "bits=12", {}, ascii<"000111101111">, expected::seed},
    {"ssi-002", "12 bits at zero", "RAA38S6 manual 3.5", "bits=12", {}, ascii<"000000000000">, expected::zero},
    {"ssi-003", "the word read twice", "RAA38S6 manual 3.5", "bits=12 extra_clocks=12", {}, ascii<"000111101111000111101111">, expected::seed},
    {"ssi-004", "the word read twice, one bit differs", "derived", "bits=12 extra_clocks=12", {}, ascii<"000111101111000111101110">, {}, Error::cross_check_failed},
    {"ssi-005", "14 clocks: thousands of degrees", "RAA38S6 manual 3.5", "bits=12", {}, ascii<"11110000111111">, {}, Error::out_of_range},
    {"ssi-006", "14 clocks: as one number it could be a position", "RAA38S6 manual 3.5", "bits=12", {}, ascii<"00011110111100">, {}, Error::wrong_length},
    {"ssi-007", "8 clocks", "RAA38S6 manual 3.5", "bits=12", {}, ascii<"00011110">, {}, Error::wrong_length},
    {"ssi-008", "Gray code over 4 bits of turns and 13 bits", "derived", "bits=13 multiturn_bits=4 gray=true", {}, ascii<"01110101100101110">, expected::gray_turns},
    {"ssi-009", "Gray code, error bit active low", "derived", "bits=13 gray=true error_bit=active_low", {}, ascii<"11011001011100">, expected::with_error},
    {"ssi-010", "error bit and even parity", "derived", "bits=13 error_bit=active_high parity=even", {}, ascii<"100100011010010">, expected::with_error},
    {"ssi-011", "error bit and odd parity", "derived", "bits=13 error_bit=active_high parity=odd", {}, ascii<"100100011010011">, expected::with_error},
    {"ssi-012", "odd parity where even is expected", "derived", "bits=13 error_bit=active_high parity=even", {}, ascii<"100100011010011">, {}, Error::bad_checksum},
    {"ssi-013", "a zero follows the word", "derived", "bits=12 after_word=zero extra_clocks=1", {}, ascii<"0001111011110">, expected::seed},
    {"ssi-014", "nobody drives the line: no zero follows", "derived", "bits=12 after_word=zero extra_clocks=1", {}, ascii<"1111111111111">, {}, Error::line_stuck},
    {"ssi-015", "more bits than 12: no zero follows the word", "derived", "bits=12 after_word=zero extra_clocks=1", {}, ascii<"0001111011111">, {}, Error::cross_check_failed},
}};
// clang-format on

namespace detail {

constexpr Format format_of(std::string_view options) {
  const auto bits_13 = [](bool gray, ErrorBit error, Parity parity, unsigned turns = 0) {
    return Format{.word = word_with({.position = 13, .multiturn = turns}, gray, error, parity)};
  };
  if (options == "bits=12 extra_clocks=12") return {.extra_clocks = 12};
  if (options == "bits=13 multiturn_bits=4 gray=true") return bits_13(true, ErrorBit::none, Parity::none, 4);
  if (options == "bits=13 gray=true error_bit=active_low") return bits_13(true, ErrorBit::active_low, Parity::none);
  if (options == "bits=13 error_bit=active_high parity=even")
    return bits_13(false, ErrorBit::active_high, Parity::even);
  if (options == "bits=13 error_bit=active_high parity=odd") return bits_13(false, ErrorBit::active_high, Parity::odd);
  if (options == "bits=12 after_word=zero extra_clocks=1") return {.after_word = AfterWord::zero, .extra_clocks = 1};
  return {};
}

constexpr bool all_hold() {
  for (const Vector& vector : vectors) {
    VectorCheck check(vector.fields);
    const auto bits = bits_of_text(vector.reply);
    if (decode(format_of(vector.options), bits.view(), check) != vector.error || !check.all()) return false;
  }
  return true;
}
static_assert(all_hold());

}  // namespace detail

}  // namespace absenc::ssi
