// SPDX-License-Identifier: Apache-2.0
// BiSS frames with their source.
#pragma once

#include <array>

#include "absenc/protocol/author/text.hpp"

namespace absenc::biss {

// clang-format off
inline constexpr auto vectors = std::to_array<author::VectorText>({
    {"biss-001", "example 1: linear, 32 bits of 0.05 um", "E201-9S document", "position_bits=32 unit_um=0.05", "", "1100000000000100000000000011000000110010000011111111101", "ack_bits=11 position=1579271 position_um=78963.55 position_mm=78.96355 error=0 warning=0 crc=0x3D"},
    {"biss-002", "example 2: linear, 26 bits of 1 um", "E201-9S document (its hexadecimal line)", "position_bits=26 unit_um=1", "", "11000000000000100000000000011111111011100111100100", "ack_bits=12 position=32697 position_um=32697.0 position_mm=32.697 error=0 warning=0 crc=36"},
    {"biss-003", "example 3: 16 bits of turns, 19 bits", "E201-9S document", "singleturn_bits=19 multiturn_bits=16", "", "110000000000000100000000000000001100001100101001100011011100", "ack_bits=13 multiturn=1 singleturn=275096 angle_deg=188.8934326171875 error=0 warning=0 crc=0x1C"},
    {"biss-004", "example 4: 19 bits", "E201-9S document", "singleturn_bits=19", "", "11000000000000010100001100101000111111110011", "ack_bits=13 singleturn=275087 angle_deg=188.8872528076172 error=0 warning=0 crc=0x33"},
    {"biss-005", "example 2 as its binary line is printed: one wrong bit", "E201-9S document", "position_bits=26 unit_um=1", "", "11000000000000100000000000011111110011100111100100", "bad_checksum"},
    {"biss-006", "example 3 with the position before the turns", "derived", "singleturn_bits=19 multiturn_bits=16 multiturn_first=false", "", "110000000000000101000011001010011000000000000000000111010011", "ack_bits=13 multiturn=1 singleturn=275096 angle_deg=188.8934326171875 error=0 warning=0 crc=19"},
    {"biss-007", "sampled from the last bit of the ACK on, nError active", "derived", "singleturn_bits=19", "", "010001001000110100010101001011", "ack_bits=1 singleturn=0x12345 angle_deg=51.19972229003906 error=1 warning=0 crc=11"},
    {"biss-008", "long idle before it, nWarning active", "derived", "singleturn_bits=19", "", "1111111110000010001001000110100010110001110", "ack_bits=5 singleturn=0x12345 angle_deg=51.19972229003906 error=0 warning=1 crc=14"},
    {"biss-009", "64 bits of position", "derived", "position_bits=64 unit_um=0.001", "", "1100010111111111111111111111111111111111111111111111111111111111111111111110110", "ack_bits=3 position=-1 position_um=18446744073709551.6 position_mm=18446744073709.5516 error=0 warning=0 crc=54"},
    {"biss-010", "1 bit of position", "derived", "singleturn_bits=1", "", "110010111110110", "ack_bits=2 singleturn=1 angle_deg=180.0 error=0 warning=0 crc=54"},
    {"biss-011", "BiSS Safety: 24 bits, life counter 63, CRC-16", "derived", "singleturn_bits=24 check=crc16", "", "1100000010101010111100110111101111111111111100001110011000", "ack_bits=6 singleturn=0xABCDEF angle_deg=241.59997701644897 error=0 warning=0 life_counter=63 crc=50072"},
    {"biss-012", "the same with one wrong bit of the life counter", "derived", "singleturn_bits=24 check=crc16", "", "1100000010101010111100110111101111110111111100001110011000", "bad_checksum"},
    {"biss-013", "nobody drives SLO", "derived", "singleturn_bits=19", "", "1111111111111111111111111111111111111111", "line_stuck"},
    {"biss-014", "SLO stays low", "derived", "singleturn_bits=19", "", "0000000000000000000000000000000000000000", "line_stuck"},
    {"biss-015", "no start bit", "derived", "singleturn_bits=19", "", "1100000000000000000000000000000000000000", "bad_framing"},
    {"biss-016", "CDS is 1", "derived", "singleturn_bits=19", "", "11000000000000011100001100101000111111110011", "bad_framing"},
    {"biss-017", "the ACK is too long for the samples", "derived", "singleturn_bits=19", "", "1100000000000000000000000000000000101010", "truncated"},
});
// clang-format on

}  // namespace absenc::biss
