// SPDX-License-Identifier: Apache-2.0
// Bit and byte-order helpers for frames of any width up to 64 bits.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "absenc/core/bytes.hpp"

namespace absenc {

/// The low `bits` bits set; 0 to 64.
[[nodiscard]] constexpr std::uint64_t low_mask(unsigned bits) {
  return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

/// True when an odd number of bits is set.
[[nodiscard]] constexpr bool odd_parity(std::uint64_t value) { return (std::popcount(value) & 1) != 0; }

/// The low `bits` bits of `value` in reverse order; 1 to 32, which a small processor shifts at once.
[[nodiscard]] constexpr std::uint32_t reflect(std::uint32_t value, unsigned bits) {
  std::uint32_t reversed = 0;
  for (unsigned i = 0; i < bits; ++i) reversed |= ((value >> i) & 1) << (bits - 1 - i);
  return reversed;
}

/// Up to 8 bytes, least significant first.
[[nodiscard]] constexpr std::uint64_t load_little_endian(Bytes bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | bytes[i];
  return value;
}

/// Up to 8 bytes, most significant first.
[[nodiscard]] constexpr std::uint64_t load_big_endian(Bytes bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

/// Fills all of `bytes` (up to 8) with the low bytes of `value`, least significant first.
constexpr void store_little_endian(MutableBytes bytes, std::uint64_t value) {
  for (std::uint8_t& byte : bytes) {
    byte = static_cast<std::uint8_t>(value);
    value >>= 8;
  }
}

/// Fills all of `bytes` (up to 8) with the low bytes of `value`, most significant first.
constexpr void store_big_endian(MutableBytes bytes, std::uint64_t value) {
  for (std::size_t i = bytes.size(); i-- > 0;) {
    bytes[i] = static_cast<std::uint8_t>(value);
    value >>= 8;
  }
}

}  // namespace absenc
