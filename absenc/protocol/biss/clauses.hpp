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

}  // namespace absenc::biss
