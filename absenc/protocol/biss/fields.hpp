// SPDX-License-Identifier: Apache-2.0
// Names and meanings of what a BiSS frame has beside its word.
#pragma once

#include <array>

#include "absenc/protocol/biss/frame.hpp"

namespace absenc::biss {

enum FieldIndex : std::size_t { field_ack_bits, field_crc, field_life_counter };

inline constexpr std::array<FieldInfo, 3> own_fields{{
    {"ack_bits", FieldInfo::Kind::number, "", "clocks until the encoder was ready"},
    {"crc", FieldInfo::Kind::number, "", "as sent: inverted"},
    {"life_counter", FieldInfo::Kind::number, "", "counts up with every reading (BiSS Safety)"},
}};

}  // namespace absenc::biss
