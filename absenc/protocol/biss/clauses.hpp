// SPDX-License-Identifier: Apache-2.0
// What the document demands of the encoder, with the place that says so.
#pragma once

#include <array>

#include "absenc/protocol/clause.hpp"

namespace absenc::biss {

inline constexpr std::array<Clause, 5> clauses{{
    {"crc", "BiSS C timing diagram, CRC", "six bits of CRC, inverted, over position and status", Demand::checked},
    {"header", "BiSS C timing diagram", "ACK, start bit and CDS bit come before the position", Demand::as_drawn},
    {.id = "bank",
     .paragraph = "BiSS C Protocol Description rev D2, register 40",
     .words = "the bank that was selected is read again",
     .demand = Demand::set,
     .value = 1,
     .setting = "bank",
     .field = "bank",
     .other = 0},
    {.id = "register-write",
     .paragraph = "BiSS C Protocol Description rev D2, register access",
     .words = "a byte that was written to a register of bank 0 is read again",
     .demand = Demand::byte_written,
     .address = 0x3F,
     .setting = "bank",
     .field = "bank"},
    {.id = "register-beside",
     .paragraph = "BiSS C Protocol Description rev D2, register access",
     .words = "writing a register leaves those beside it",
     .demand = Demand::byte_alone,
     .address = 0x3F,
     .setting = "bank",
     .field = "bank"},
}};

// BiSS Safety: a control word and a safety word, each with its own check.
inline constexpr std::array<Clause, 2> safety_clauses{{
    {"crc", "BiSS Safety, CPW and SPW", "CRC-6 over the control word, CRC-16 over the safety word, both inverted",
     Demand::checked},
    {"header", "BiSS C timing diagram", "ACK, start bit and CDS bit come before the words", Demand::as_drawn},
}};

inline constexpr std::array<Clause, 2> chain_clauses{{
    {"crc", "BiSS C timing diagram, CRC", "each encoder's CRC, inverted, over its own position and status",
     Demand::checked},
    {"header", "BiSS C timing diagram", "ACK, start bit and CDS bit come before the first encoder's word",
     Demand::as_drawn},
}};

}  // namespace absenc::biss
