// SPDX-License-Identifier: Apache-2.0
// Builds the bit ranges of a value in a frame of bytes, for `Unit::bits`.
#pragma once

#include <algorithm>
#include <cstddef>

#include "absenc/protocol/unit.hpp"

namespace absenc::author {

/// Returns the range of `count` bits from bit `first` of byte number `byte` on; no range if `count` is 0.
[[nodiscard]] constexpr BitRanges bits_of(std::size_t byte, std::size_t first, std::size_t count) {
  BitRanges ranges;
  if (count != 0) ranges.push_back({8 * byte + first, count});
  return ranges;
}

/// Returns the ranges of `count` bits, from bit `first` on, of the big-endian number in `size` bytes from `byte` on.
[[nodiscard]] constexpr BitRanges big_endian_bits(std::size_t byte, std::size_t size, std::size_t count,
                                                  std::size_t first = 0) {
  BitRanges ranges;
  for (std::size_t i = size - first / 8; i > 0 && count > 0; --i) {
    const std::size_t here = std::min(count, 8 - first % 8);
    ranges.push_back({8 * (byte + i - 1) + first % 8, here});
    first += here;
    count -= here;
  }
  return ranges;
}

}  // namespace absenc::author
