// SPDX-License-Identifier: Apache-2.0
// Where the bits of a control frame stand, for those who send, answer and decode it.
#pragma once

#include <cstdint>

#include "absenc/protocol/biss/control.hpp"

namespace absenc::biss::control_bits {

using Operation = ControlRequest::Operation;

// Frames, counted from that of the start bit, whose CDM or CDS these are.
inline constexpr unsigned lock_bits_at = 1;
inline constexpr unsigned more_slaves_at = 9;
inline constexpr unsigned direction_at = 16;    // CDM: R, W, then S. CDS: one later
inline constexpr unsigned acknowledge_at = 17;  // CDS: IDA0 to IDA7
inline constexpr unsigned byte_bits = 12;       // and their CRC

/// Whether a byte and the CRC behind it, 12 bits, agree.
[[nodiscard]] constexpr bool is_good_byte(std::uint16_t bits) { return crc4_of(bits >> 4, 8) == (bits & 0xF); }

}  // namespace absenc::biss::control_bits
