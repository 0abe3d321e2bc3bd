// SPDX-License-Identifier: Apache-2.0
// A position reading, and functions that convert counts to degrees or micrometres.
#pragma once

#include <bit>
#include <cstdint>

#include "absenc/core/bits.hpp"
#include "absenc/core/time.hpp"

namespace absenc {

/// How far one part of a reading (single-turn position or turns) can be trusted.
enum class Validity : std::uint8_t {
  absent,   ///< the reply does not contain this part of the reading
  unknown,  ///< it is not known whether this part of the reading is valid: do not use it
  invalid,  ///< a reported alarm or state marks this part of the reading as invalid
  valid,    ///< every alarm and state that could make this part of the reading invalid was reported, and is clear
};

/// Returns the low `bits` (1 to 64) of `value` as a signed number in two's complement.
[[nodiscard]] constexpr std::int64_t with_sign(std::uint64_t value, unsigned bits) {
  const std::uint64_t sign = std::uint64_t{1} << (bits - 1);
  return static_cast<std::int64_t>(((value & low_mask(bits)) ^ sign) - sign);
}

/// One position as an encoder reported it, and which parts of it can be trusted.
struct Reading {
  std::uint64_t singleturn = 0;  ///< single-turn position in counts, 0 .. 2^singleturn_bits - 1
  /// Raw number of revolutions, 0 .. 2^multiturn_bits - 1; `turns()` returns it with its sign.
  std::uint64_t multiturn = 0;
  unsigned singleturn_bits = 0;        ///< width of `singleturn` in bits; 0: the reply carries no single-turn position
  unsigned multiturn_bits = 0;         ///< width of `multiturn` in bits; 0: the reply carries no revolutions
  unsigned singleturn_valid_bits = 0;  ///< number of valid bits of `singleturn`, counted from the top; 0: do not use it
  bool multiturn_valid = false;        ///< Whether the number of revolutions in `multiturn` can be trusted.
  /// true: it is known whether `singleturn` is valid; false: it is not, so `singleturn` must not be used
  bool singleturn_known = true;
  /// true: it is known whether `multiturn` is valid; false: it is not, so `multiturn` must not be used
  bool multiturn_known = true;
  /// true: the encoder counts turns below zero, and `multiturn` is in two's complement
  bool multiturn_signed = false;
  double unit_um = 0;        ///< linear encoders: micrometres per count of `singleturn`; 0: rotary encoder
  bool ready = true;         ///< false: the encoder reports that it is starting
  std::uint32_t status = 0;  ///< status bits: those of the unit's status field, then those of its second status field
  std::uint32_t alarms = 0;  ///< alarm bits: those of the unit's alarms field, then those of its second alarms field
  /// mask of the bits of `status` that the encoder reported; the others are unknown, not clear
  std::uint32_t status_reported = 0;
  /// mask of the bits of `alarms` that the encoder reported; the others are unknown, not clear
  std::uint32_t alarms_reported = 0;
  /// Point in time at which the shaft is assumed to have had this position.
  Time latched{};
  Time received{};  ///< time at which the last byte of the reply arrived

  /// Returns whether all bits of the single-turn position can be trusted.
  [[nodiscard]] constexpr bool singleturn_valid() const {
    return singleturn_bits != 0 && singleturn_valid_bits == singleturn_bits;
  }
  /// Returns `valid` if all bits of the single-turn position can be trusted; else the reason why not.
  [[nodiscard]] constexpr Validity singleturn_validity() const {
    if (singleturn_bits == 0) return Validity::absent;
    if (!singleturn_known) return Validity::unknown;
    return singleturn_valid() ? Validity::valid : Validity::invalid;
  }
  /// Returns the number of revolutions, with a sign if the encoder counts them so.
  [[nodiscard]] constexpr std::int64_t turns() const {
    if (multiturn_signed && multiturn_bits != 0) return with_sign(multiturn, multiturn_bits);
    return static_cast<std::int64_t>(multiturn);
  }
  /// Returns `valid` if the number of revolutions can be trusted; else the reason why not.
  [[nodiscard]] constexpr Validity multiturn_validity() const {
    if (multiturn_bits == 0) return Validity::absent;
    if (!multiturn_known) return Validity::unknown;
    return multiturn_valid ? Validity::valid : Validity::invalid;
  }
};

/// Returns the angle in degrees, 0 to below 360; a revolution has 2^bits counts, 1 to 64 bits.
[[nodiscard]] constexpr double degrees(std::uint64_t counts, unsigned bits) {
  // with more than 48 bits the quotient might be rounded up to 360, so only the upper 48 bits are used
  if (bits > 48) return degrees(counts >> (bits - 48), 48);
  return 180.0 * static_cast<double>(counts) / static_cast<double>(std::uint64_t{1} << (bits - 1));
}

/// Returns whether `unit_um`, in micrometres per count, is above 0: the encoder is linear. Compares the bits of the
/// number, so that firmware links no floating point.
[[nodiscard]] constexpr bool is_linear(double unit_um) { return std::bit_cast<std::int64_t>(unit_um) > 0; }

/// Converts counts, or counts per second, of a linear encoder to micrometres (per second).
[[nodiscard]] constexpr double micrometres(double counts, double unit_um) { return counts * unit_um; }
/// Returns the position of a linear encoder in micrometres.
[[nodiscard]] constexpr double micrometres(std::uint64_t counts, double unit_um) {
  return micrometres(static_cast<double>(counts), unit_um);
}
/// Returns the position of a linear encoder in micrometres.
[[nodiscard]] constexpr double micrometres(std::int64_t counts, double unit_um) {
  return micrometres(static_cast<double>(counts), unit_um);
}

/// Returns the shortest signed distance from `from` to `to` on a circle of 2^bits counts, 1 to 63 bits: from
/// -2^(bits-1) to 2^(bits-1) - 1.
[[nodiscard]] constexpr std::int64_t wrapped_difference(std::uint64_t to, std::uint64_t from, unsigned bits) {
  return with_sign(to - from, bits);
}

}  // namespace absenc
