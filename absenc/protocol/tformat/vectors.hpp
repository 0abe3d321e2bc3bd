// SPDX-License-Identifier: Apache-2.0
// T-format frames with their source. Each is decoded at compile time: a broken frame does not build.
#pragma once

#include <array>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/tformat/fields.hpp"
#include "absenc/protocol/unit.hpp"
#include "absenc/protocol/vector_check.hpp"

namespace absenc::tformat {

namespace expected {
inline constexpr std::array<Expected, 2> v001{{{"data_id", 0}, {"control_field", 2}}};
inline constexpr std::array<Expected, 2> v002{{{"data_id", 1}, {"control_field", 138}}};
inline constexpr std::array<Expected, 2> v003{{{"data_id", 2}, {"control_field", 146}}};
inline constexpr std::array<Expected, 2> v004{{{"data_id", 3}, {"control_field", 26}}};
inline constexpr std::array<Expected, 2> v005{{{"data_id", 7}, {"control_field", 186}}};
inline constexpr std::array<Expected, 2> v006{{{"data_id", 8}, {"control_field", 194}}};
inline constexpr std::array<Expected, 2> v007{{{"data_id", 12}, {"control_field", 98}}};
inline constexpr std::array<Expected, 3> v020{{{"data_id", 0}, {"status", 0x00}, {"singleturn", 109517}}};
inline constexpr std::array<Expected, 3> v021{{{"data_id", 0}, {"status", 0x00}, {"singleturn", 0}}};
inline constexpr std::array<Expected, 3> v022{{{"data_id", 0}, {"status", 0x00}, {"singleturn", 131071}}};
inline constexpr std::array<Expected, 3> v024{{{"data_id", 2}, {"status", 0x00}, {"encoder_id", 17}}};
inline constexpr std::array<Expected, 6> v025{{{"data_id", 3},
                                               {"status", 0x20},
                                               {"singleturn", 74565},
                                               {"encoder_id", 17},
                                               {"multiturn", 4660},
                                               {"alarms", 0x10}}};
inline constexpr std::array<Expected, 6> v029{
    {{"data_id", 3}, {"status", 0x00}, {"singleturn", 0}, {"encoder_id", 17}, {"multiturn", 0}, {"alarms", 0x08}}};
inline constexpr std::array<Expected, 6> v030{
    {{"data_id", 3}, {"status", 0x20}, {"singleturn", 0}, {"encoder_id", 17}, {"multiturn", 0}, {"alarms", 0x10}}};
inline constexpr std::array<Expected, 6> v032{
    {{"data_id", 3}, {"status", 0x20}, {"singleturn", 0}, {"encoder_id", 17}, {"multiturn", 0}, {"alarms", 0x40}}};
inline constexpr std::array<Expected, 6> v033{
    {{"data_id", 3}, {"status", 0x20}, {"singleturn", 0}, {"encoder_id", 17}, {"multiturn", 0}, {"alarms", 0x80}}};
inline constexpr std::array<Expected, 3> v034{{{"data_id", 7}, {"status", 0x00}, {"singleturn", 64206}}};
inline constexpr std::array<Expected, 3> v036{{{"data_id", 12}, {"status", 0x00}, {"singleturn", 64206}}};
inline constexpr std::array<Expected, 4> v040{{{"data_id", 13}, {"address", 1}, {"busy", 0}, {"value", 90}}};
inline constexpr std::array<Expected, 4> v042{{{"data_id", 13}, {"address", 5}, {"busy", 0}, {"value", 60}}};
inline constexpr std::array<Expected, 4> v043{{{"data_id", 13}, {"address", 4}, {"busy", 0}, {"value", 218}}};
inline constexpr std::array<Expected, 3> v101{{{"data_id", 1}, {"status", 0x00}, {"multiturn", 4660}}};
inline constexpr std::array<Expected, 3> v102{{{"data_id", 8}, {"status", 0x00}, {"singleturn", 64206}}};
inline constexpr std::array<Expected, 6> v103{
    {{"data_id", 3}, {"status", 0x10}, {"singleturn", 1}, {"encoder_id", 17}, {"multiturn", 0}, {"alarms", 0x04}}};
inline constexpr std::array<Expected, 6> v106{
    {{"data_id", 3}, {"status", 0x20}, {"singleturn", 1}, {"encoder_id", 17}, {"multiturn", 0}, {"alarms", 0x00}}};
inline constexpr std::array<Expected, 4> v107{{{"data_id", 13}, {"address", 1}, {"busy", 1}, {"value", 0}}};
inline constexpr std::array<Expected, 4> v108{{{"data_id", 6}, {"address", 1}, {"busy", 0}, {"value", 90}}};
inline constexpr std::array<Expected, 6> v112{{{"data_id", 3},
                                               {"status", 0x00},
                                               {"singleturn", 8388607},
                                               {"encoder_id", 23},
                                               {"multiturn", 65535},
                                               {"alarms", 0x00}}};
inline constexpr std::array<Expected, 4> v114{{{"data_id", 6}, {"control_field", 50}, {"address", 1}, {"value", 90}}};
}  // namespace expected

// clang-format off
inline constexpr std::array<Vector, 43> vectors{{
    {"tformat-001", "request byte Data ID 0", "seed Table 1; public", "", hex<"02">, hex<"">, expected::v001},
    {"tformat-002", "request byte Data ID 1", "seed Table 1; public", "", hex<"8a">, hex<"">, expected::v002},
    {"tformat-003", "request byte Data ID 2", "seed Table 1; public", "", hex<"92">, hex<"">, expected::v003},
    {"tformat-004", "request byte Data ID 3", "seed Table 1; public", "", hex<"1a">, hex<"">, expected::v004},
    {"tformat-005", "request byte Data ID 7", "seed Table 1; public", "", hex<"ba">, hex<"">, expected::v005},
    {"tformat-006", "request byte Data ID 8", "seed Table 1; public", "", hex<"c2">, hex<"">, expected::v006},
    {"tformat-007", "request byte Data ID C", "seed Table 1; public", "", hex<"62">, hex<"">, expected::v007},
    {"tformat-020", "ID0 ABS=0x1ABCD", "derived", "", hex<"02">, hex<"0200cdab0165">, expected::v020},
    {"tformat-021", "ID0 ABS=0", "derived", "", hex<"02">, hex<"020000000002">, expected::v021},
    {"tformat-022", "ID0 ABS=max", "derived", "", hex<"02">, hex<"0200ffff0103">, expected::v022},
    {"tformat-024", "ID2 ENID=0x11", "seed", "", hex<"92">, hex<"92001183">, expected::v024},
    {"tformat-025", "ID3 all fields", "derived", "", hex<"1a">, hex<"1a2045230111341200107a">, expected::v025},
    {"tformat-029", "ID3 ALMC bit 3 = OF", "derived", "", hex<"1a">, hex<"1a00000000110000000803">, expected::v029},
    {"tformat-030", "ID3 ALMC bit 4 = OH", "derived", "", hex<"1a">, hex<"1a2000000011000000103b">, expected::v030},
    {"tformat-032", "ID3 ALMC bit 6 = BE", "derived", "", hex<"1a">, hex<"1a2000000011000000406b">, expected::v032},
    {"tformat-033", "ID3 ALMC bit 7 = BA", "derived", "", hex<"1a">, hex<"1a200000001100000080ab">, expected::v033},
    {"tformat-034", "reset ID7 reply (each of the 10 requests is answered)", "derived", "", hex<"ba">, hex<"ba00cefa008e">, expected::v034},
    {"tformat-036", "reset IDC reply (each of the 10 requests is answered)", "derived", "", hex<"62">, hex<"6200cefa0056">, expected::v036},
    {"tformat-040", "EEPROM read ok", "derived", "", hex<"ea01eb">, hex<"ea015ab1">, expected::v040},
    {"tformat-042", "temperature page 7 addr 5 = 3C -> 60 C", "seed 7.3.1 + computed framing", "", hex<"ea05ef">, hex<"ea053cd3">, expected::v042},
    {"tformat-043", "overheat threshold page 7 addr 4 = DA -> 90 C (bit7 enable)", "seed 7.2.1 + computed framing", "", hex<"ea04ee">, hex<"ea04da34">, expected::v043},
    {"tformat-045", "delimiter error in request: ID3 with ca1", "derived", "", hex<"ea01eb">, hex<"1a8000000011000000008b">, {}, Error::request_rejected},
    {"tformat-046", "EEPROM request with bad CRC/closed address: plain ID3 reply", "derived", "", hex<"32015a69">, hex<"1a0000000011000000000b">, {}, Error::request_rejected},
    {"tformat-047", "1-bit error", "derived", "", hex<"1a">, hex<"1a0055230111341200004a">, {}, Error::bad_checksum},
    {"tformat-048", "truncated by one byte", "derived", "", hex<"1a">, hex<"1a004523011134120000">, {}, Error::wrong_length},
    {"tformat-049", "one extra byte (echo 0x00)", "derived", "", hex<"1a">, hex<"1a0045230111341200004a00">, {}, Error::wrong_length},
    {"tformat-051", "2-bit column error caught only by the range check (ABS2 b5, ABM2 b5)", "derived", "", hex<"1a">, hex<"1a0045232111341220004a">, {}, Error::out_of_range},
    {"tformat-052", "SF information bits set", "derived", "", hex<"02">, hex<"020100000003">, {}, Error::unexpected_reply},
    {"tformat-054", "CF with bad parity", "derived", "", hex<"02">, hex<"820000000082">, {}, Error::unexpected_reply},
    {"tformat-101", "ID1 turns", "derived", "", hex<"8a">, hex<"8a00341200ac">, expected::v101},
    {"tformat-102", "ID8 reply (each of the 10 requests is answered)", "derived", "", hex<"c2">, hex<"c200cefa00f6">, expected::v102},
    {"tformat-103", "counting error shows in SF and ALMC", "derived", "", hex<"1a">, hex<"1a1001000011000000041e">, expected::v103},
    {"tformat-104", "SF does not show the over-heat of ALMC", "derived", "", hex<"1a">, hex<"1a0001000011000000101a">, {}, Error::cross_check_failed},
    {"tformat-105", "SF shows an alarm that ALMC does not have", "derived", "", hex<"1a">, hex<"1a2001000011000000002a">, {}, Error::cross_check_failed},
    {"tformat-106", "the same for an encoder that deviates", "derived", "strict=false", hex<"1a">, hex<"1a2001000011000000002a">, expected::v106},
    {"tformat-107", "EEPROM busy: not executed, EDF 00", "seed Table 5", "", hex<"ea01eb">, hex<"ea81006b">, expected::v107},
    {"tformat-108", "EEPROM write accepted", "seed Table 5", "", hex<"32015a69">, hex<"32015a69">, expected::v108},
    {"tformat-109", "EEPROM write answered for another address", "derived", "", hex<"32015a69">, hex<"32025a6a">, {}, Error::unexpected_reply},
    {"tformat-110", "parity error of the request: ID3 with ca0", "seed 6.3.2", "", hex<"02">, hex<"1a4000000011000000004b">, {}, Error::request_rejected},
    {"tformat-111", "another encoder: ENID 17 where 11 is expected", "derived", "", hex<"92">, hex<"92001785">, {}, Error::unexpected_reply},
    {"tformat-112", "23 bits, ENID 17", "derived", "singleturn_bits=23", hex<"1a">, hex<"1a00ffff7f17ffff000072">, expected::v112},
    {"tformat-113", "23 bits: the 24th is set", "derived", "singleturn_bits=23", hex<"02">, hex<"020000008082">, {}, Error::out_of_range},
    {"tformat-114", "EEPROM write request", "seed 6.2.2", "", hex<"32015a69">, hex<"">, expected::v114},
}};
// clang-format on

namespace detail {

constexpr bool holds(const Vector& vector) {
  Format format;
  if (vector.options == "singleturn_bits=23") format = {.singleturn_bits = 23, .encoder_id = 0x17};
  if (vector.options == "strict=false") format.strict = false;
  VectorCheck check(vector.fields);
  const Error error = decode(format, vector.request, vector.reply, check);
  return error == vector.error && check.all();
}

constexpr bool all_hold() {
  for (const Vector& vector : vectors) {
    if (!holds(vector)) return false;
  }
  return true;
}
static_assert(all_hold());

}  // namespace detail

}  // namespace absenc::tformat
