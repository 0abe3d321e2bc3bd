// SPDX-License-Identifier: Apache-2.0
// Test replies of an E201-9S with their source, checked at compile time.
#pragma once

#include <array>

#include "absenc/protocol/author/text.hpp"

namespace absenc::e201 {

/// Test replies, each with the fields or the error that decoding must give.
inline constexpr auto vectors = std::to_array<author::VectorText>({
    {"e201-biss-001", "example 1, 32-bit linear 0.05 um", "seed", "singleturn_bits=32 multiturn_bits=0", "4",
     "c0040030320ffac0\r", "ack_bits=11 singleturn=1579271 angle_deg=0.13237296603620052 error=0 warning=0 crc=61"},
    {"e201-biss-002",
     "example 2, 26-bit linear 1 um (hex is right; the seed's binary line has 1100 for 1110 at nibble 9)", "seed",
     "singleturn_bits=26 multiturn_bits=0", "4", "c002001fee790000\r",
     "ack_bits=12 singleturn=32697 angle_deg=0.17540037631988525 error=0 warning=0 crc=36"},
    {"e201-biss-003", "example 3, MT16+ST19", "seed", "singleturn_bits=19 multiturn_bits=16", "4", "c0010000c3298dc0\r",
     "ack_bits=13 multiturn=1 singleturn=275096 angle_deg=188.8934326171875 error=0 warning=0 crc=28"},
    {"e201-biss-004", "example 4, ST19 (position decimal garbled in the seed: '5087')", "seed",
     "singleturn_bits=19 multiturn_bits=0", "4", "c0014328ff300000\r",
     "ack_bits=13 singleturn=275087 angle_deg=188.8872528076172 error=0 warning=0 crc=51"},
    {"e201-biss-005", "seed example 2 binary line as printed -> CRC error", "seed",
     "singleturn_bits=26 multiturn_bits=0", "4", "c002001fce790000\r", "bad_checksum"},
    {"e201-biss-006", "error flag (nErr=0)", "derived", "singleturn_bits=32 multiturn_bits=0", "4",
     "c010000181cad800\r", "ack_bits=9 singleturn=12345 angle_deg=0.0010347459465265274 error=1 warning=0 crc=27"},
    {"e201-biss-008", "ACK of 1 bit, 48-bit position", "derived", "singleturn_bits=48 multiturn_bits=0", "4",
     "d55e6f78091a2fb8\r",
     "ack_bits=1 singleturn=188900966474565 angle_deg=241.5999771118159 error=0 warning=0 crc=55"},
    {"e201-biss-010", "ignored bits may be 1", "derived", "singleturn_bits=19 multiturn_bits=0", "4",
     "c00112345cd7ffff\r", "ack_bits=13 singleturn=74565 angle_deg=51.19972229003906 error=0 warning=0 crc=13"},
    {"e201-biss-012", "single bit error in position", "derived", "singleturn_bits=19 multiturn_bits=0", "4",
     "c0014228ff300000\r", "bad_checksum"},
    {"e201-biss-014", "CRC sent non-inverted", "derived", "singleturn_bits=19 multiturn_bits=0", "4",
     "c0014328fcc00000\r", "bad_checksum"},
    {"e201-biss-015", "CDS bit = 1", "derived", "singleturn_bits=19 multiturn_bits=0", "4", "c001c328ff300000\r",
     "bad_framing"},
    {"e201-biss-016", "ACK too long: frame falls out of the 64 bits (lower MA clock)", "derived",
     "singleturn_bits=32 multiturn_bits=0", "4", "c000000000000001\r", "truncated"},
    {"e201-biss-017", "no start bit", "derived", "singleturn_bits=32 multiturn_bits=0", "4", "c000000000000000\r",
     "bad_framing"},
    {"e201-biss-018", "all zeros (line low / no encoder)", "derived", "singleturn_bits=32 multiturn_bits=0", "4",
     "0000000000000000\r", "line_stuck"},
    {"e201-biss-020", "first bits are not 11", "derived", "singleturn_bits=32 multiturn_bits=0", "4",
     "4004003000000000\r", "bad_framing"},
    {"e201-biss-021", "third idle one", "derived", "singleturn_bits=32 multiturn_bits=0", "4", "e004003000000000\r",
     "bad_framing"},
    {"e201-biss-023", "non-hex reply", "derived", "singleturn_bits=32 multiturn_bits=0", "4", "c0040030320ffag0\r",
     "bad_framing"},
    {"e201-biss-024", "missing CR", "derived", "singleturn_bits=32 multiturn_bits=0", "4", "c0040030320ffac0",
     "wrong_length"},
    {"e201-101", "example 1 as the linear encoder that it is", "E201-9S document", "position_bits=32 unit_um=0.05", "4",
     "c0040030320ffac0\r",
     "ack_bits=11 position=1579271 position_um=78963.55 position_mm=78.96355 error=0 warning=0 crc=61"},
    {"e201-102", "example 2 as the linear encoder that it is", "E201-9S document", "position_bits=26 unit_um=1", "4",
     "c002001fee790000\r",
     "ack_bits=12 position=32697 position_um=32697.0 position_mm=32.697 error=0 warning=0 crc=36"},
    {"e201-103", "example 4 in capitals", "derived", "singleturn_bits=19 multiturn_bits=0", "4", "C0014328FF300000\r",
     "ack_bits=13 singleturn=275087 angle_deg=188.8872528076172 error=0 warning=0 crc=51"},
    {"e201-104", "no encoder: SLO stays high", "derived", "singleturn_bits=19 multiturn_bits=0", "4",
     "ffffffffffffffff\r", "line_stuck"},
    {"e201-105", "an SSI encoder of 12 bits that repeats its word", "derived",
     "singleturn_bits=12 multiturn_bits=0 carries=ssi", "4", "8f78f78f78f78f78\r",
     "singleturn=495 angle_deg=43.505859375"},
    {"e201-106", "the same with zeros behind the word", "derived",
     "singleturn_bits=12 multiturn_bits=0 carries=ssi after_word=zero", "4", "8f78000000000000\r",
     "singleturn=495 angle_deg=43.505859375"},
    {"e201-107", "it has 13 bits, not 12", "derived", "singleturn_bits=12 multiturn_bits=0 carries=ssi after_word=zero",
     "4", "8f7c000000000000\r", "cross_check_failed"},
    {"e201-108", "a frame that begins one sample late", "derived", "singleturn_bits=19 multiturn_bits=0", "4",
     "e000a1947f980000\r", "bad_framing"},
});

}  // namespace absenc::e201
