// SPDX-License-Identifier: Apache-2.0
// Bit positions in a control frame, shared by host, encoders and decoder.
#pragma once

#include <cstdint>

#include "absenc/protocol/biss/control.hpp"

namespace absenc::biss::control_bits {

/// Kind of a control request.
using Operation = ControlRequest::Operation;

/// Positions of CDM and CDS bits, as frames counted from the start bit.
inline constexpr unsigned lock_bits_at = 1;
inline constexpr unsigned more_slaves_at = 9;   ///< Position of the bit that announces more slaves.
inline constexpr unsigned direction_at = 16;    ///< CDM: the bits R, W, then S; CDS: one frame later
inline constexpr unsigned acknowledge_at = 17;  ///< CDS: the first of the acknowledge bits IDA0 to IDA7
inline constexpr unsigned byte_bits = 12;       ///< bits of a byte and its CRC

/// Returns whether a byte and its CRC, 12 bits, agree.
[[nodiscard]] constexpr bool is_good_byte(std::uint16_t bits) { return crc4_of(bits >> 4, 8) == (bits & 0xF); }

}  // namespace absenc::biss::control_bits
