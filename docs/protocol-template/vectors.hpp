// SPDX-License-Identifier: Apache-2.0
// protocol_name frames with their source. When decode_reply is written, static_assert them here.
#pragma once

#include <array>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::protocol_name {

inline constexpr std::array<Expected, 1> first_position{{{"singleturn", 1}}};

inline constexpr std::array<Vector, 1> vectors{{
    {"protocol_name-001", "the first frame of the document", "document, paragraph", "", hex<"01">, hex<"000107">, first_position},
}};

}  // namespace absenc::protocol_name
