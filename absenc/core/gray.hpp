// SPDX-License-Identifier: Apache-2.0
// Reflected binary (Gray) code: neighbouring counts differ in one bit.
#pragma once

#include <cstdint>

namespace absenc {

/// Returns the Gray code of `binary`.
[[nodiscard]] constexpr std::uint64_t gray_encode(std::uint64_t binary) { return binary ^ (binary >> 1); }

/// Returns the number, of up to 64 bits, whose Gray code is `gray`.
[[nodiscard]] constexpr std::uint64_t gray_decode(std::uint64_t gray) {
  for (unsigned shift = 1; shift < 64; shift *= 2) gray ^= gray >> shift;
  return gray;
}

}  // namespace absenc
