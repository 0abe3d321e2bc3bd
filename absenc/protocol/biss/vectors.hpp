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
    {"biss-011", "BiSS Safety: 24 bits, life counter 63, CRC-16", "derived", "singleturn_bits=24 crc_width=16 crc_poly=0x90D9 life_counter=true", "", "1100000010101010111100110111101111111111111100001110011000", "ack_bits=6 singleturn=0xABCDEF angle_deg=241.59997701644897 error=0 warning=0 life_counter=63 crc=50072"},
    {"biss-012", "the same with one wrong bit of the life counter", "derived", "singleturn_bits=24 crc_width=16 crc_poly=0x90D9 life_counter=true", "", "1100000010101010111100110111101111110111111100001110011000", "bad_checksum"},
    {"biss-013", "nobody drives SLO", "derived", "singleturn_bits=19", "", "1111111111111111111111111111111111111111", "line_stuck"},
    {"biss-014", "SLO stays low", "derived", "singleturn_bits=19", "", "0000000000000000000000000000000000000000", "line_stuck"},
    {"biss-015", "no start bit", "derived", "singleturn_bits=19", "", "1100000000000000000000000000000000000000", "bad_framing"},
    {"biss-016", "CDS is 1", "derived", "singleturn_bits=19", "", "11000000000000011100001100101000111111110011", "bad_framing"},
    {"biss-017", "the ACK is too long for the samples", "derived", "singleturn_bits=19", "", "1100000000000000000000000000000000101010", "truncated"},
    {"biss-018", "12 bits, 270 deg, warning bit 01: CRC 2D as logged", "public log: TI motor-control-sdk docs, BISS-C sample output", "singleturn_bits=12", "", "11000001011000000000001101101", "ack_bits=5 singleturn=3072 angle_deg=270.0 error=1 warning=0 crc=45"},
    {"biss-019", "12 bits, 123.574 deg: CRC 36 as logged", "public log: TI motor-control-sdk docs, BISS-C sample output", "singleturn_bits=12", "", "11000001001010111111011110110", "ack_bits=5 singleturn=1406 angle_deg=123.57421875 error=0 warning=0 crc=54"},
    {"biss-020", "SPW alone: 65535 turns, 256.992 deg, life counter 57: CRC D79F as logged", "public log: TI motor-control-sdk docs, BISS-C sample output", "singleturn_bits=12 multiturn_bits=16 crc_width=16 crc_poly=0x90D9 life_counter=true", "", "1100000101111111111111111101101101100011110011101011110011111", "ack_bits=5 multiturn=65535 singleturn=2924 angle_deg=256.9921875 error=1 warning=0 life_counter=57 crc=55199"},
    {"biss-021", "12 + 12 bits, turns A5A, position FB0: CRC 20 as logged", "public log: hpmicro/hpm_sdk SEI BiSS-C sample", "singleturn_bits=12 multiturn_bits=12", "", "11000001010100101101011111011000011100000", "ack_bits=5 multiturn=2650 singleturn=4016 angle_deg=352.96875 error=0 warning=0 crc=32"},
    {"biss-022", "12 + 12 bits, turns A5A, position FBF: CRC 27 as logged", "public log: hpmicro/hpm_sdk SEI BiSS-C sample", "singleturn_bits=12 multiturn_bits=12", "", "11000001010100101101011111011111111100111", "ack_bits=5 multiturn=2650 singleturn=4031 angle_deg=354.287109375 error=0 warning=0 crc=39"},
    {"biss-023", "8 bits 0x97 (0x197), position and turns", "derived", "singleturn_bits=19 multiturn_bits=12 crc_width=8 crc_poly=0x97", "", "1100000001000010010001110110100101101001011101011100", "ack_bits=7 multiturn=291 singleturn=370085 angle_deg=254.11720275878906 error=0 warning=0 crc=92"},
    {"biss-024", "8 bits 0x97, start FF, position and turns", "derived", "singleturn_bits=19 multiturn_bits=12 crc_width=8 crc_poly=0x97 crc_init=0xFF", "", "1100000001000010010001110110100101101001011110001110", "ack_bits=7 multiturn=291 singleturn=370085 angle_deg=254.11720275878906 error=0 warning=0 crc=142"},
    {"biss-025", "8 bits 0x97, not inverted, position and turns", "derived", "singleturn_bits=19 multiturn_bits=12 crc_width=8 crc_poly=0x97 crc_inverted=false", "", "1100000001000010010001110110100101101001011110100011", "ack_bits=7 multiturn=291 singleturn=370085 angle_deg=254.11720275878906 error=0 warning=0 crc=163"},
    {"biss-026", "7 bits, 0x97 read with its top bit, position and turns", "derived", "singleturn_bits=19 multiturn_bits=12 crc_width=7 crc_poly=0x17", "", "110000000100001001000111011010010110100101110000100", "ack_bits=7 multiturn=291 singleturn=370085 angle_deg=254.11720275878906 error=0 warning=0 crc=4"},
    {"biss-027", "16 bits 0x190D9, start 1234, position and turns", "derived", "singleturn_bits=19 multiturn_bits=12 crc_width=16 crc_poly=0x90D9 crc_init=0x1234", "", "110000000100001001000111011010010110100101111101000101101011", "ack_bits=7 multiturn=291 singleturn=370085 angle_deg=254.11720275878906 error=0 warning=0 crc=53611"},
    {"biss-028", "16 bits 0x190D9, start 1234, life counter, position and turns", "derived", "singleturn_bits=19 multiturn_bits=12 crc_width=16 crc_poly=0x90D9 crc_init=0x1234 life_counter=true", "", "110000000100001001000111011010010110100101111010011010100001010001", "ack_bits=7 multiturn=291 singleturn=370085 angle_deg=254.11720275878906 error=0 warning=0 life_counter=41 crc=43089"},
    {"biss-029", "16 bits 0x190D9, start FFFF, position and turns", "derived", "singleturn_bits=19 multiturn_bits=12 crc_width=16 crc_poly=0x90D9 crc_init=0xFFFF", "", "110000000100001001000111011010010110100101110101011000010100", "ack_bits=7 multiturn=291 singleturn=370085 angle_deg=254.11720275878906 error=0 warning=0 crc=22036"},
    {"biss-030", "16 bits 0x190D9, start FFFF, life counter, position and turns", "derived", "singleturn_bits=19 multiturn_bits=12 crc_width=16 crc_poly=0x90D9 crc_init=0xFFFF life_counter=true", "", "110000000100001001000111011010010110100101111010011010010010001101", "ack_bits=7 multiturn=291 singleturn=370085 angle_deg=254.11720275878906 error=0 warning=0 life_counter=41 crc=42125"},
    {"biss-031", "8 bits 0x12F, position and turns", "derived", "singleturn_bits=19 multiturn_bits=12 crc_width=8 crc_poly=0x2F", "", "1100000001000010010001110110100101101001011111001001", "ack_bits=7 multiturn=291 singleturn=370085 angle_deg=254.11720275878906 error=0 warning=0 crc=201"},
    {"biss-032", "no CRC, position and turns", "derived", "singleturn_bits=19 multiturn_bits=12 crc_width=0 crc_poly=0x0", "", "11000000010000100100011101101001011010010111", "ack_bits=7 multiturn=291 singleturn=370085 angle_deg=254.11720275878906 error=0 warning=0"},
    {"biss-033", "8 bits 0x97: data bit flipped", "derived", "singleturn_bits=18 crc_width=8 crc_poly=0x97", "", "11000000101010011110111011111111001001", "bad_checksum"},
    {"biss-034", "8 bits 0x97: CRC bit flipped", "derived", "singleturn_bits=18 crc_width=8 crc_poly=0x97", "", "11000000101010111110111011111111001000", "bad_checksum"},
    {"biss-035", "16 bits: data bit flipped", "derived", "singleturn_bits=18 crc_width=16 crc_poly=0x90D9 life_counter=true", "", "1100000010101001111011101111110000110010110001000011", "bad_checksum"},
    {"biss-036", "16 bits: CRC bit flipped", "derived", "singleturn_bits=18 crc_width=16 crc_poly=0x90D9 life_counter=true", "", "1100000010101011111011101111110000110010110001000010", "bad_checksum"},
    {"biss-037", "start value 2A sent, 0 expected", "derived", "singleturn_bits=18", "", "110000001010101111101110111111000000", "bad_checksum"},
    {"biss-038", "CRC not inverted although expected so", "derived", "singleturn_bits=18", "", "110000001010101111101110111111001111", "bad_checksum"},
    {"biss-039", "16 bits: life counter bit flipped", "derived", "singleturn_bits=18 crc_width=16 crc_poly=0x90D9 life_counter=true", "", "1100000010000000000000000001110110011010110011100101", "bad_checksum"},
    {"biss-040", "null value: all bits 0 with a good CRC: error and warning set", "BiSS C Protocol Description rev D2, null value", "singleturn_bits=18", "", "110000001000000000000000000000111111", "ack_bits=6 singleturn=0 angle_deg=0.0 error=1 warning=1 crc=63"},
});

inline constexpr auto safety_vectors = std::to_array<author::VectorText>({
    {"biss-safety-001", "RXM, good", "derived", "cpw_singleturn_bits=16 cpw_multiturn_bits=0 spw_singleturn_bits=12 spw_multiturn_bits=0 compare_bits=9 previous_life_counter=9", "", "110000010101010111100110111100000101010111100110010100101101110001101", "ack_bits=5 cpw_singleturn=43981 angle_deg=241.5948486328125 cpw_error=0 cpw_warning=0 cpw_crc=32 spw_singleturn=2748 spw_error=0 spw_warning=0 spw_life_counter=10 spw_crc=23437"},
    {"biss-safety-002", "RXH, good", "derived", "previous_life_counter=10", "", "110000010000100100011010001010110111101010001001000110100110010110011101001111000", "ack_bits=5 cpw_singleturn=1193046 angle_deg=25.599989891052246 cpw_error=0 cpw_warning=0 cpw_crc=53 spw_singleturn=4660 spw_error=0 spw_warning=0 spw_life_counter=11 spw_crc=14968"},
    {"biss-safety-003", "RSM, good", "derived", "cpw_singleturn_bits=16 cpw_multiturn_bits=12 spw_singleturn_bits=12 spw_multiturn_bits=12 compare_bits=9 previous_life_counter=11", "", "110000010000000000101100000000000000111001001000000000101100000000000110011001011111110001000", "ack_bits=5 cpw_multiturn=5 cpw_singleturn=32769 angle_deg=180.0054931640625 cpw_error=0 cpw_warning=0 cpw_crc=9 spw_multiturn=5 spw_singleturn=2048 spw_error=0 spw_warning=0 spw_life_counter=12 spw_crc=49032"},
    {"biss-safety-004", "life counter rolls over 63 -> 0", "derived", "previous_life_counter=63", "", "110000010000100100011010001010110111101010001001000110100110000000110111100001101", "ack_bits=5 cpw_singleturn=1193046 angle_deg=25.599989891052246 cpw_error=0 cpw_warning=0 cpw_crc=53 spw_singleturn=4660 spw_error=0 spw_warning=0 spw_life_counter=0 spw_crc=28429"},
    {"biss-safety-005", "first frame: no previous life counter", "derived", "", "", "110000010000100100011010001010110111101010001001000110100111000011011110000010001", "ack_bits=5 cpw_singleturn=1193046 angle_deg=25.599989891052246 cpw_error=0 cpw_warning=0 cpw_crc=53 spw_singleturn=4660 spw_error=0 spw_warning=0 spw_life_counter=33 spw_crc=48145"},
    {"biss-safety-006", "CPW CRC wrong", "derived", "previous_life_counter=1", "", "110000010000100100011010001010110111101000001001000110100110000101101111001100110", "bad_checksum"},
    {"biss-safety-007", "SPW CRC wrong", "derived", "previous_life_counter=1", "", "110000010000100100011010001010110111101010001001000110100110000100101111001100110", "bad_checksum"},
    {"biss-safety-008", "both CRCs wrong", "derived", "cpw_singleturn_bits=24 cpw_multiturn_bits=12 spw_singleturn_bits=16 spw_multiturn_bits=12 compare_bits=13 previous_life_counter=1", "", "110000010000000000011000100100011010001010110111010100000000000110001001000110100110000101011101100101001", "bad_checksum"},
    {"biss-safety-009", "CPW data bit flipped", "derived", "previous_life_counter=1", "", "110000010100100100011010001010110111101010001001000110100110000101101111001100110", "bad_checksum"},
    {"biss-safety-010", "SPW warning bit flipped", "derived", "previous_life_counter=1", "", "110000010000100100011010001010110111101010001001000110100100000101101111001100110", "bad_checksum"},
    {"biss-safety-011", "SPW life counter bit flipped", "derived", "previous_life_counter=1", "", "110000010000100100011010001010110111101010001001000110100110000111101111001100110", "bad_checksum"},
    {"biss-safety-012", "words differ by 1 at the compared bits: tolerated", "derived", "previous_life_counter=1", "", "110000010000100100011010001010110111101010001001000111100110000101100011010101000", "ack_bits=5 cpw_singleturn=1193046 angle_deg=25.599989891052246 cpw_error=0 cpw_warning=0 cpw_crc=53 spw_singleturn=4668 spw_error=0 spw_warning=0 spw_life_counter=2 spw_crc=50856"},
    {"biss-safety-013", "words differ by 2: refused", "derived", "previous_life_counter=1", "", "110000010000100100011010001010110111101010001001001000100110000100100101010110010", "cross_check_failed"},
    {"biss-safety-014", "turns only in the CPW", "derived", "cpw_singleturn_bits=24 cpw_multiturn_bits=12 spw_singleturn_bits=16 spw_multiturn_bits=0 compare_bits=13 previous_life_counter=1", "", "110000010111111111111010000000000000000000000110101010100000000000000110000100111110111110000", "ack_bits=5 cpw_multiturn=4095 cpw_singleturn=4194304 angle_deg=90.0 cpw_error=0 cpw_warning=0 cpw_crc=21 spw_singleturn=16384 spw_error=0 spw_warning=0 spw_life_counter=2 spw_crc=32240"},
    {"biss-safety-015", "error bit in the CPW only: data, not an error", "derived", "previous_life_counter=1", "", "110000010000100100011010001010110011100110001001000110100110000101101111001100110", "ack_bits=5 cpw_singleturn=1193046 angle_deg=25.599989891052246 cpw_error=1 cpw_warning=0 cpw_crc=51 spw_singleturn=4660 spw_error=0 spw_warning=0 spw_life_counter=2 spw_crc=56934"},
    {"biss-safety-016", "CPW of another start value", "derived", "previous_life_counter=1", "", "110000010000100100011010001010110110111010001001000110100110000101101111001100110", "bad_checksum"},
    {"biss-safety-017", "frame cut in the SPW", "derived", "previous_life_counter=1", "", "1100000100001001000110100010101101111010100010010001101001100001011011110011", "truncated"},
    {"biss-safety-018", "frame cut after the CPW", "derived", "previous_life_counter=1", "", "11000001000010010001101000101011011110101", "truncated"},
    {"biss-safety-019", "no answer: all ones", "derived", "previous_life_counter=1", "", "111111111111111111111111111111111111111111111111111111111111111111111111111111111", "line_stuck"},
});

inline constexpr auto chain_vectors = std::to_array<author::VectorText>({
    {"biss-chain-001", "three slaves, CRC of the last wrong", "derived", "slaves=3 channel0_singleturn_bits=18 channel1_singleturn_bits=12 channel1_multiturn_bits=12 channel2_singleturn_bits=8 channel2_crc_width=5 channel2_crc_poly=0x5", "", "11000000100000000000000000011111011000000000001100000000001011100101100001001101010", "bad_checksum"},
    {"biss-chain-002", "two slaves, CRC of the first wrong", "derived", "slaves=2 channel0_singleturn_bits=18 channel1_singleturn_bits=12 channel1_multiturn_bits=12", "", "11000000101000000000000000011111011000000000001100000000001011100101", "bad_checksum"},
});
// clang-format on

}  // namespace absenc::biss
