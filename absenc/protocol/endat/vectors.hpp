// SPDX-License-Identifier: Apache-2.0
// EnDat frames with their fields or their error, decoded by the compiler. README.md names the sources of the checksums.
#pragma once

#include <array>

#include "absenc/protocol/author/text.hpp"

namespace absenc::endat {

/// Test vectors: requests and replies as bits, in the order of the line.
// clang-format off
inline constexpr auto vectors = std::array{
    author::VectorText{"endat-1", "2.1 position 0x123, 13 bits", "computed twice", "singleturn_bits=13 version=2.1", "00000111", "000000010110001001000000101", "command=7 start_clocks=15 singleturn=291 f1=0"},
    author::VectorText{"endat-2", "2.1 position 0x1234567, 25 bits, CRC 06", "simulated VHDL slave", "singleturn_bits=25 version=2.1", "00000111", "000000010111001101010001011000100100110", "command=7 start_clocks=15 singleturn=19088743 f1=0"},
    author::VectorText{"endat-3", "2.1 position with turns, 37 bits", "computed twice", "singleturn_bits=25 multiturn_bits=12 version=2.1", "00000111", "000000010111101110111110110110101011110110101110101", "command=7 start_clocks=15 multiturn=3439 singleturn=11386607 f1=0"},
    author::VectorText{"endat-4", "2.2 position 0x1234567, no error", "computed twice", "singleturn_bits=25", "00111000", "00101111001101010001011000100101000", "command=56 start_clocks=10 singleturn=19088743 f1=0 f2=1"},
    author::VectorText{"endat-5", "2.2 position with an error", "computed twice", "singleturn_bits=25", "00111000", "00110111001101010001011000100101011", "command=56 start_clocks=10 singleturn=19088743 f1=1 f2=0"},
    author::VectorText{"endat-6", "2.2 position with both informations", "computed", "singleturn_bits=25 info1=0x4D info2=0x51", "00111000", "00101111001101010001011000100101000011010001100010011010101110100011001101000010111011100001010", "command=56 start_clocks=10 singleturn=19088743 f1=0 f2=1 warning=1 referenced=1 busy=0 info1_code=77 info1=3000 info2_code=81 info2=35243"},
    author::VectorText{"endat-7", "selection of area A1, CRC 1C", "sine-encoder simulator", "", "00001110101000010000000000000000", "00000110100001000000000000000011100", "command=14 start_clocks=37 area=161"},
    author::VectorText{"endat-8", "word 13 has the number of bits, CRC 15", "sine-encoder simulator", "", "00100011000011010000000000000000", "00000100001101100000000000110110101", "command=35 start_clocks=37 address=13 value=32781"},
    author::VectorText{"endat-9", "write of 10000 to word 100, CRC 1E", "published C code", "", "00011100011001000010011100010000", "00000101100100001001110001000011110", "command=28 start_clocks=37 address=100 value=10000"},
    author::VectorText{"endat-10", "refused write: another address", "computed", "", "00011100011001000010011100010000", "00000110011011001001110001000000110", "request_rejected"},
    author::VectorText{"endat-11", "reset, repeated", "published C code", "", "00101010000000000000000000000000", "00000100000000000000000000000011000", "command=42 start_clocks=37"},
    author::VectorText{"endat-12", "selection of the memory area BD with a position", "computed", "singleturn_bits=25", "0000100100000001101111010000000000000000", "00101101000000000000000000000000010", "command=9 area=189 start_clocks=10 singleturn=5 f1=0 f2=1"},
    author::VectorText{"endat-13", "wrong checksum", "computed", "singleturn_bits=25", "00111000", "00101111001101010001011000100101001", "bad_checksum"},
    author::VectorText{"endat-14", "no start bit", "computed", "singleturn_bits=25", "00111000", "000000000000000000000000000000000000", "line_stuck"},
    author::VectorText{"endat-15", "reply without its last bit", "computed", "singleturn_bits=25", "00111000", "0010111100110101000101100010010100", "truncated"},
    author::VectorText{"endat-16", "linear position of 32 bits", "computed", "position_bits=32 unit_um=0.01", "00111000", "001010001111001101010001011000100100010111", "command=56 start_clocks=10 position=305419896 position_um=3054198.96 f1=0 f2=1"},
};
// clang-format on

}  // namespace absenc::endat
