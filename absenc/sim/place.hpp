// SPDX-License-Identifier: Apache-2.0
// Conversion of a shaft position to counts and turns, and comparison of readings with it.
#pragma once

#include <optional>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"

namespace absenc::sim {

/// Returns the single-turn counts of an encoder with `bits` bits at `position`, unit 2^-32 revolution.
[[nodiscard]] constexpr std::uint64_t counts_at(std::int64_t position, unsigned bits) {
  const auto fraction = static_cast<std::uint64_t>(position) & 0xFFFF'FFFF;
  if (bits == 0) return 0;
  // If the encoder has more than 32 bits, the bits that are finer than 2^-32 revolution are 0.
  return (bits <= 32 ? fraction >> (32 - bits) : static_cast<std::uint64_t>(position) << (bits - 32)) & low_mask(bits);
}

/// Returns the turns of a counter with `bits` bits at `position`, unit 2^-32 revolution.
[[nodiscard]] constexpr std::uint64_t turns_at(std::int64_t position, unsigned bits) {
  return bits == 0 ? 0 : static_cast<std::uint64_t>(position >> 32) & low_mask(bits);
}

/// Returns whether the valid parts of `reading` equal `position`, unit 2^-32 revolution.
[[nodiscard]] constexpr bool is_at(const Reading& reading, std::int64_t position) {
  if (reading.singleturn_bits != 0 && reading.singleturn_valid_bits != 0) {
    const unsigned open = reading.singleturn_bits - reading.singleturn_valid_bits;
    if (reading.singleturn >> open != counts_at(position, reading.singleturn_bits) >> open) return false;
  }
  return !reading.multiturn_valid || reading.multiturn == turns_at(position, reading.multiturn_bits);
}

/// Returns whether two readings agree in position and turns. A part that one of them lacks is not compared.
[[nodiscard]] constexpr bool same_place(const std::optional<Reading>& one, const std::optional<Reading>& other) {
  if (!one || !other) return true;
  if (one->singleturn_valid_bits != 0 && other->singleturn_valid_bits != 0 && one->singleturn != other->singleturn) {
    return false;
  }
  return !one->multiturn_valid || !other->multiturn_valid || one->multiturn == other->multiturn;
}

}  // namespace absenc::sim
