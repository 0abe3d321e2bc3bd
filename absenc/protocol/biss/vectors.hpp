// SPDX-License-Identifier: Apache-2.0
// BiSS frames with their source. Each is decoded at compile time: a broken frame does not build.
#pragma once

#include <array>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/biss/fields.hpp"
#include "absenc/protocol/vector_check.hpp"

namespace absenc::biss {

namespace expected {
inline constexpr std::array<Expected, 7> example_1{{{"ack_bits", 11},
                                                    {"position", 1579271},
                                                    {"position_um", 0, 78963.55},
                                                    {"position_mm", 0, 78.96355},
                                                    {"error", 0},
                                                    {"warning", 0},
                                                    {"crc", 0x3D}}};
inline constexpr std::array<Expected, 7> example_2{{{"ack_bits", 12},
                                                    {"position", 32697},
                                                    {"position_um", 0, 32697},
                                                    {"position_mm", 0, 32.697},
                                                    {"error", 0},
                                                    {"warning", 0},
                                                    {"crc", 36}}};
inline constexpr std::array<Expected, 7> example_3{{{"ack_bits", 13},
                                                    {"multiturn", 1},
                                                    {"singleturn", 275096},
                                                    {"angle_deg", 0, 188.8934326171875},
                                                    {"error", 0},
                                                    {"warning", 0},
                                                    {"crc", 0x1C}}};
inline constexpr std::array<Expected, 6> example_4{{{"ack_bits", 13},
                                                    {"singleturn", 275087},
                                                    {"angle_deg", 0, 188.8872528076172},
                                                    {"error", 0},
                                                    {"warning", 0},
                                                    {"crc", 0x33}}};
inline constexpr std::array<Expected, 7> singleturn_first{{{"ack_bits", 13},
                                                           {"multiturn", 1},
                                                           {"singleturn", 275096},
                                                           {"angle_deg", 0, 188.8934326171875},
                                                           {"error", 0},
                                                           {"warning", 0},
                                                           {"crc", 19}}};
inline constexpr std::array<Expected, 6> sampled_in_ack{{{"ack_bits", 1},
                                                         {"singleturn", 0x12345},
                                                         {"angle_deg", 0, 51.19972229003906},
                                                         {"error", 1},
                                                         {"warning", 0},
                                                         {"crc", 11}}};
inline constexpr std::array<Expected, 6> warning{{{"ack_bits", 5},
                                                  {"singleturn", 0x12345},
                                                  {"angle_deg", 0, 51.19972229003906},
                                                  {"error", 0},
                                                  {"warning", 1},
                                                  {"crc", 14}}};
inline constexpr std::array<Expected, 7> widest{{{"ack_bits", 3},
                                                 {"position", -1},
                                                 {"position_um", 0, 18446744073709551616.0 * 0.001},
                                                 {"position_mm", 0, 18446744073709551616.0 * 0.001 / 1000},
                                                 {"error", 0},
                                                 {"warning", 0},
                                                 {"crc", 54}}};
inline constexpr std::array<Expected, 6> narrowest{
    {{"ack_bits", 2}, {"singleturn", 1}, {"angle_deg", 0, 180}, {"error", 0}, {"warning", 0}, {"crc", 54}}};
inline constexpr std::array<Expected, 7> safety{{{"ack_bits", 6},
                                                 {"singleturn", 0xABCDEF},
                                                 {"angle_deg", 0, 241.59997701644897},
                                                 {"error", 0},
                                                 {"warning", 0},
                                                 {"life_counter", 63},
                                                 {"crc", 50072}}};
}  // namespace expected

// clang-format off
inline constexpr std::array<Vector, 17> vectors{{
    {"biss-001", "example 1: linear, 32 bits of 0.05 um", "E201-9S document", "position_bits=32 unit_um=0.05", {}, ascii<"1100000000000100000000000011000000110010000011111111101">, expected::example_1},
    {"biss-002", "example 2: linear, 26 bits of 1 um", "E201-9S document (its hexadecimal line)", "position_bits=26 unit_um=1", {}, ascii<"11000000000000100000000000011111111011100111100100">, expected::example_2},
    {"biss-003", "example 3: 16 bits of turns, 19 bits", "E201-9S document", "singleturn_bits=19 multiturn_bits=16", {}, ascii<"110000000000000100000000000000001100001100101001100011011100">, expected::example_3},
    {"biss-004", "example 4: 19 bits", "E201-9S document", "singleturn_bits=19", {}, ascii<"11000000000000010100001100101000111111110011">, expected::example_4},
    {"biss-005", "example 2 as its binary line is printed: one wrong bit", "E201-9S document", "position_bits=26 unit_um=1", {}, ascii<"11000000000000100000000000011111110011100111100100">, {}, Error::bad_checksum},
    {"biss-006", "example 3 with the position before the turns", "derived", "singleturn_bits=19 multiturn_bits=16 multiturn_first=false", {}, ascii<"110000000000000101000011001010011000000000000000000111010011">, expected::singleturn_first},
    {"biss-007", "sampled from the last bit of the ACK on, nError active", "derived", "singleturn_bits=19", {}, ascii<"010001001000110100010101001011">, expected::sampled_in_ack},
    {"biss-008", "long idle before it, nWarning active", "derived", "singleturn_bits=19", {}, ascii<"1111111110000010001001000110100010110001110">, expected::warning},
    {"biss-009", "64 bits of position", "derived", "position_bits=64 unit_um=0.001", {}, ascii<"1100010111111111111111111111111111111111111111111111111111111111111111111110110">, expected::widest},
    {"biss-010", "1 bit of position", "derived", "singleturn_bits=1", {}, ascii<"110010111110110">, expected::narrowest},
    {"biss-011", "BiSS Safety: 24 bits, life counter 63, CRC-16", "derived", "singleturn_bits=24 check=crc16", {}, ascii<"1100000010101010111100110111101111111111111100001110011000">, expected::safety},
    {"biss-012", "the same with one wrong bit of the life counter", "derived", "singleturn_bits=24 check=crc16", {}, ascii<"1100000010101010111100110111101111110111111100001110011000">, {}, Error::bad_checksum},
    {"biss-013", "nobody drives SLO", "derived", "singleturn_bits=19", {}, ascii<"1111111111111111111111111111111111111111">, {}, Error::line_stuck},
    {"biss-014", "SLO stays low", "derived", "singleturn_bits=19", {}, ascii<"0000000000000000000000000000000000000000">, {}, Error::line_stuck},
    {"biss-015", "no start bit", "derived", "singleturn_bits=19", {}, ascii<"1100000000000000000000000000000000000000">, {}, Error::bad_framing},
    {"biss-016", "CDS is 1", "derived", "singleturn_bits=19", {}, ascii<"11000000000000011100001100101000111111110011">, {}, Error::bad_framing},
    {"biss-017", "the ACK is too long for the samples", "derived", "singleturn_bits=19", {}, ascii<"1100000000000000000000000000000000101010">, {}, Error::truncated},
}};
// clang-format on

namespace detail {

constexpr Format format_of(std::string_view options) {
  const auto made = [](const PositionBits& bits, const Scale& scale = {}, Check check = Check::crc6) {
    return Format{word_with_status(bits), check, scale};
  };
  if (options == "position_bits=32 unit_um=0.05") return made({.position = 32}, {true, 0.05});
  if (options == "position_bits=26 unit_um=1") return made({.position = 26}, {true, 1});
  if (options == "position_bits=64 unit_um=0.001") return made({.position = 64}, {true, 0.001});
  if (options == "singleturn_bits=19 multiturn_bits=16") return made({.position = 19, .multiturn = 16});
  if (options == "singleturn_bits=19 multiturn_bits=16 multiturn_first=false") return made({19, 16, false});
  if (options == "singleturn_bits=1") return made({.position = 1});
  if (options == "singleturn_bits=24 check=crc16") return made({.position = 24}, {}, Check::crc16);
  return made({.position = 19});
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

}  // namespace absenc::biss
