// SPDX-License-Identifier: Apache-2.0
// The bits of a classic CAN frame on the bus (ISO 11898-1, 10.4): 0 is dominant, 1 recessive.
#pragma once

#include <cstddef>
#include <vector>

#include "absenc/link/can.hpp"

namespace absenc::sim {

/// Returns the bits of `frame` on the bus, with stuff bits and the acknowledge bit.
[[nodiscard]] std::vector<bool> can_bits(const CanFrame& frame);

/// Returns the number of bits that `can_bits` returns, without allocating memory.
[[nodiscard]] std::size_t can_bit_count(const CanFrame& frame);

/// Smallest number of recessive bits between two CAN frames.
inline constexpr std::size_t can_intermission_bits = 3;

}  // namespace absenc::sim
