// SPDX-License-Identifier: Apache-2.0
// Bit positions in a BiSS control frame, shared by host, encoders and decoder.
#pragma once

#include <cstdint>

#include "absenc/protocol/biss/control.hpp"

namespace absenc::biss::control_bits {

/// Kind of a control request.
using Operation = ControlRequest::Operation;

/// Position of the first lock bit in CDS, in frames from the start bit of the control frame.
inline constexpr unsigned lock_bits_at = 1;
inline constexpr unsigned more_slaves_at = 9;  ///< Position of the bit that announces slaves without an ID.
/// Position of R, the first of the CDM bits R, W and S; in CDS these bits are one frame later.
inline constexpr unsigned direction_at = 16;
inline constexpr unsigned acknowledge_at = 17;  ///< Position of the first of the acknowledge bits IDA0 to IDA7 in CDS.
inline constexpr unsigned byte_bits = 12;       ///< Number of bits of a data byte and its CRC.

/// Returns whether the CRC in the lowest 4 of these 12 bits is that of the data byte above it.
[[nodiscard]] constexpr bool is_good_byte(std::uint16_t bits) { return crc4_of(bits >> 4, 8) == (bits & 0xF); }

}  // namespace absenc::biss::control_bits
