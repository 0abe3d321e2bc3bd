// SPDX-License-Identifier: Apache-2.0
// A classic CAN frame as the bits that go over the bus (ISO 11898-1, 10.4): 0 is dominant, 1 recessive and idle.
#pragma once

#include <cstddef>
#include <vector>

#include "absenc/link/can.hpp"

namespace absenc::sim {

/// From the start of the frame to its end, stuff bits included, as another node acknowledges it.
[[nodiscard]] std::vector<bool> can_bits(const CanFrame& frame);

/// Between two frames.
inline constexpr std::size_t can_intermission_bits = 3;

}  // namespace absenc::sim
