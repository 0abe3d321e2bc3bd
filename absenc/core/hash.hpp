// SPDX-License-Identifier: Apache-2.0
// A hash of bytes.
#pragma once

#include <cstdint>

#include "absenc/core/bytes.hpp"

namespace absenc {

/// Returns the hash FNV-1a (32 bits) of the bytes. `before`: the hash of the bytes that stand before them.
[[nodiscard]] constexpr std::uint32_t fnv1a(Bytes bytes, std::uint32_t before = 0x811C'9DC5) {
  for (const std::uint8_t byte : bytes) before = (before ^ byte) * 0x0100'0193;
  return before;
}

}  // namespace absenc
