// SPDX-License-Identifier: Apache-2.0
// Reflected binary (Gray) code: neighbouring counts differ in one bit.
#pragma once

#include <cstdint>

namespace absenc {

[[nodiscard]] constexpr std::uint64_t gray_encode(std::uint64_t binary) { return binary ^ (binary >> 1); }

/// Any width up to 64 bits: the prefix XOR is folded over all of them (a loop of four shifts stops at 16 bits).
[[nodiscard]] constexpr std::uint64_t gray_decode(std::uint64_t gray) {
  for (unsigned shift = 1; shift < 64; shift *= 2) gray ^= gray >> shift;
  return gray;
}

}  // namespace absenc
