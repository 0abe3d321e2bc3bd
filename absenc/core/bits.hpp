// SPDX-License-Identifier: Apache-2.0
// Bit and byte-order helpers for frames of any width up to 64 bits.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "absenc/core/bytes.hpp"

namespace absenc {

/// Returns a mask with the low `bits` (0 to 64) bits set.
[[nodiscard]] constexpr std::uint64_t low_mask(unsigned bits) {
  return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

/// Returns whether an odd number of bits of `value` is set.
[[nodiscard]] constexpr bool odd_parity(std::uint64_t value) { return (std::popcount(value) & 1) != 0; }

/// Returns the low `bits` (1 to 32) bits of `value` in reverse order.
[[nodiscard]] constexpr std::uint32_t reflect(std::uint32_t value, unsigned bits) {
  std::uint32_t reversed = 0;
  for (unsigned i = 0; i < bits; ++i) reversed |= ((value >> i) & 1) << (bits - 1 - i);
  return reversed;
}

/// Returns the number that up to 8 bytes contain, least significant byte first.
[[nodiscard]] constexpr std::uint64_t load_little_endian(Bytes bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | bytes[i];
  return value;
}

/// Returns the number that up to 8 bytes contain, most significant byte first.
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
