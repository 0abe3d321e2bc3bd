// SPDX-License-Identifier: Apache-2.0
// protocol_name frames: encode, decode and every check a frame allows. README.md draws them.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/core/bytes.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/core/result.hpp"
#include "absenc/protocol/field.hpp"

namespace absenc::protocol_name {

// Taken from the document, checked against a frame of it in vectors.hpp.
inline constexpr CrcParameters crc_parameters{.width = 8, .poly = 0x07, .init = 0, .refin = false, .refout = false, .xorout = 0};

inline constexpr std::array<FieldInfo, 1> fields{{
    {"singleturn", FieldInfo::Kind::number, "counts", "position within the turn"},
}};

struct Reply {
  std::uint32_t singleturn = 0;
};

/// Checks in this order: length, checksum, echo or address, refusal, fixed bits, range, cross checks.
[[nodiscard]] constexpr Result<Reply> decode_reply(Bytes bytes) {
  static_cast<void>(bytes);
  return Error::unsupported;
}

}  // namespace absenc::protocol_name
