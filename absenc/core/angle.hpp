// SPDX-License-Identifier: Apache-2.0
// A position reading and the only place where counts become an angle or a way.
#pragma once

#include <cstdint>

#include "absenc/core/bits.hpp"
#include "absenc/core/time.hpp"

namespace absenc {

/// What an encoder has reported about a part of its position.
enum class Validity : std::uint8_t {
  absent,   // the reply does not carry this part
  unknown,  // it carries it, but neither this reply nor an earlier one reports whether it holds: do not use it
  invalid,  // an alarm or a state that was reported says that it does not hold
  valid,    // everything that could make it invalid was reported, and clear
};

/// The low `bits` of `value` as a number with a sign, two's complement. 1 to 64 bits.
[[nodiscard]] constexpr std::int64_t with_sign(std::uint64_t value, unsigned bits) {
  const std::uint64_t sign = std::uint64_t{1} << (bits - 1);
  return static_cast<std::int64_t>(((value & low_mask(bits)) ^ sign) - sign);
}

/// One position as an encoder reported it, with what of it may be trusted.
struct Reading {
  std::uint64_t singleturn = 0;        // counts, 0 .. 2^singleturn_bits - 1
  std::uint64_t multiturn = 0;         // revolutions, 0 .. 2^multiturn_bits - 1; people are shown `turns()`
  unsigned singleturn_bits = 0;        // 0: the reply carries no single-turn position
  unsigned multiturn_bits = 0;         // 0: the reply carries no revolutions
  unsigned singleturn_valid_bits = 0;  // the top bits that hold; 0: do not use the position
  bool multiturn_valid = false;
  bool singleturn_known = true;   // false: no reply so far reports whether the position holds; then it is not valid
  bool multiturn_known = true;    // the same of the turns
  bool multiturn_signed = false;  // the encoder counts them below zero: two's complement of `multiturn_bits`
  double unit_um = 0;             // linear encoders: micrometres a count of `singleturn`; 0: a rotation
  bool ready = true;              // false while the encoder says that it is starting
  std::uint32_t status = 0;       // bits named by the unit's status field, then those of its second
  std::uint32_t alarms = 0;       // bits named by the unit's alarms field, then those of its second
  std::uint32_t status_reported =
      0;  // the bits of `status` that were reported; a bit that was not is unknown, not clear
  std::uint32_t alarms_reported = 0;  // the same of `alarms`
  Time latched{};                     // when the encoder took the position
  Time received{};                    // when the last byte of the reply was there

  [[nodiscard]] constexpr bool singleturn_valid() const {
    return singleturn_bits != 0 && singleturn_valid_bits == singleturn_bits;
  }
  [[nodiscard]] constexpr Validity singleturn_validity() const {
    if (singleturn_bits == 0) return Validity::absent;
    if (!singleturn_known) return Validity::unknown;
    return singleturn_valid() ? Validity::valid : Validity::invalid;
  }
  /// Revolutions as the encoder counts them, below zero where its turns have a sign.
  [[nodiscard]] constexpr std::int64_t turns() const {
    if (multiturn_signed && multiturn_bits != 0) return with_sign(multiturn, multiturn_bits);
    return static_cast<std::int64_t>(multiturn);
  }
  [[nodiscard]] constexpr Validity multiturn_validity() const {
    if (multiturn_bits == 0) return Validity::absent;
    if (!multiturn_known) return Validity::unknown;
    return multiturn_valid ? Validity::valid : Validity::invalid;
  }
};

/// Degrees, 0 to below 360. A revolution has 2^bits counts, not 2^bits - 1. 1 to 64 bits.
[[nodiscard]] constexpr double degrees(std::uint64_t counts, unsigned bits) {
  if (bits > 48) return degrees(counts >> (bits - 48), 48);  // more would be rounded up to 360
  return 180.0 * static_cast<double>(counts) / static_cast<double>(std::uint64_t{1} << (bits - 1));
}

/// The way of a linear encoder, or that in a second.
[[nodiscard]] constexpr double micrometres(double counts, double unit_um) { return counts * unit_um; }
[[nodiscard]] constexpr double micrometres(std::uint64_t counts, double unit_um) {
  return micrometres(static_cast<double>(counts), unit_um);
}
[[nodiscard]] constexpr double micrometres(std::int64_t counts, double unit_um) {
  return micrometres(static_cast<double>(counts), unit_um);
}

/// The shortest way from `from` to `to` on a circle of 2^bits counts: -2^(bits-1) .. 2^(bits-1) - 1. 1 to 63 bits.
[[nodiscard]] constexpr std::int64_t wrapped_difference(std::uint64_t to, std::uint64_t from, unsigned bits) {
  return with_sign(to - from, bits);
}

}  // namespace absenc
