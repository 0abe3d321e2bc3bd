// SPDX-License-Identifier: Apache-2.0
// What the document demands of the encoder, with the place that says so.
#pragma once

#include <array>

#include "absenc/protocol/clause.hpp"

namespace absenc::biss {

inline constexpr std::array<Clause, 2> clauses{{
    {"crc", "BiSS C timing diagram, CRC", "six bits of CRC, inverted, over position and status", Demand::checked},
    {"header", "BiSS C timing diagram", "ACK, start bit and CDS bit come before the position", Demand::as_drawn},
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
