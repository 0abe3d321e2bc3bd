// SPDX-License-Identifier: Apache-2.0
// Speed limit of a shaft or carriage, and how far apart in place and time two readings may be.
#pragma once

#include <bit>
#include <cstdint>

#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// Highest speed that a shaft or carriage is assumed to have.
struct SpeedLimit {
  /// Speed limit of rotary encoders in revolutions per minute.
  std::uint32_t rpm = 10'000;
  /// Speed limit of linear encoders in mm/s. The default is a speed that no linear axis is assumed to exceed.
  std::uint32_t mm_s = 20'000;
};

/// A movement faster than the speed limit counts as a jump only from this multiple of the limit on.
inline constexpr unsigned most_excess = 4;

/// Returns the speed limit of the model in `options`, or else the default limit.
[[nodiscard]] constexpr SpeedLimit speed_limit(const Options& options) {
  SpeedLimit limit;
  if (options.model != nullptr && options.model->maximum_rpm != 0) limit.rpm = options.model->maximum_rpm;
  return limit;
}

/// Returns by how many counts the position changes in a second at the speed limit. Needs floating point: firmware uses
/// `Reach`.
[[nodiscard]] constexpr double counts_per_second(const Resolution& resolution, const SpeedLimit& limit) {
  if (resolution.unit_um > 0) return limit.mm_s * 1000.0 / resolution.unit_um;
  const unsigned bits = resolution.singleturn_bits;
  return limit.rpm / 60.0 * (bits >= 63 ? 9.2e18 : static_cast<double>(std::uint64_t{1} << bits));
}

/// Returns the time in which the position changes by 15/32 of the counted range at the speed limit, at most `never`.
/// Needs floating point: firmware uses `Reach::share`.
[[nodiscard]] constexpr Time longest_gap(const Resolution& resolution, const SpeedLimit& limit) {
  const bool linear = resolution.unit_um > 0;
  const unsigned bits = linear ? resolution.singleturn_bits : resolution.multiturn_bits;
  const double range =
      bits >= 63 ? 9.2e18
                 : static_cast<double>(std::uint64_t{1} << bits);  // counted range, in counts (linear) or turns
  // Speed limit in counts (linear) or turns per second.
  const double speed = linear ? limit.mm_s * 1000.0 / resolution.unit_um : limit.rpm / 60.0;
  const double nanoseconds = speed > 0 ? 15.0 / 32 * range / speed * 1e9 : 9.2e18;
  return nanoseconds < 9.2e18 ? Time(static_cast<std::int64_t>(nanoseconds)) : never;
}

/// The distance that a shaft or carriage can move in a given time at its speed limit. All distances are rounded up by
/// 2^-29 of their value at most, and then down to a whole number.
class Reach {
 public:
  /// Returns the reach of a shaft of at most `rpm` revolutions per minute.
  [[nodiscard]] static constexpr Reach of_shaft(std::uint32_t rpm) {
    // the speed 1 rpm in turns per ns, times 2^67, rounded up
    constexpr std::uint64_t turns_a_ns_of_1_rpm = 2'459'565'877;
    return {turns_a_ns_of_1_rpm * rpm, 67, true};
  }
  /// Returns the reach of a carriage of at most `mm_s` mm/s with counts of `unit_um` micrometres, above 0.
  [[nodiscard]] static constexpr Reach of_carriage(std::uint32_t mm_s, double unit_um) {
    // unit_um = unit * 2^exponent. Both are taken from the bits of the number, so that no floating point is linked.
    const auto bits = std::bit_cast<std::uint64_t>(unit_um);
    // mantissa of `unit_um`, rounded down to 32 bits
    const std::uint32_t unit = static_cast<std::uint32_t>(bits >> 21) | 0x8000'0000;
    const int exponent = static_cast<int>(bits >> 52 & 0x7FF) - (1023 + 31);
    if (mm_s == 0) return {0, 0, false};
    const int zeros = std::countl_zero(std::uint64_t{mm_s});
    // a dividend from 2^63 to 2^64 and a divisor from 2^31 to 2^32 give a quotient from 2^31 to 2^33
    const std::uint64_t speed = (std::uint64_t{mm_s} << zeros) / unit + 1;
    return {(speed << 30) / 1'000'000 + 1, zeros + exponent + 30, false};
  }
  /// Returns the reach of the shaft or carriage that `resolution` describes, within `limit`.
  [[nodiscard]] static constexpr Reach of(const SpeedLimit& limit, const Resolution& resolution) {
    return is_linear(resolution.unit_um) ? of_carriage(limit.mm_s, resolution.unit_um) : of_shaft(limit.rpm);
  }

  /// Returns the reach at a speed of `times` times the speed limit.
  [[nodiscard]] constexpr Reach at_excess(std::uint32_t times) const {
    return {std::uint64_t{factor_} * times, shift_, turns_};
  }

  /// Returns by how many counts the position can change in the time `between`; at most 2^64 - 1. `singleturn_bits`: 1
  /// to 64.
  [[nodiscard]] constexpr std::uint64_t counts(Time between, unsigned singleturn_bits) const {
    return scaled(between, turns_ ? static_cast<int>(singleturn_bits) : 0);
  }
  /// Returns which part of the counted range of `resolution` the position can move in the time `between`, times 2^32;
  /// at most 2^64 - 1.
  [[nodiscard]] constexpr std::uint64_t share(Time between, const Resolution& resolution) const {
    return scaled(between, 32 - static_cast<int>(turns_ ? resolution.multiturn_bits : resolution.singleturn_bits));
  }

 private:
  // `speed` is the speed limit in turns (linear: counts) per nanosecond, times 2^shift.
  constexpr Reach(std::uint64_t speed, int shift, bool turns) : turns_(turns) {
    const int halvings = halve(speed);
    factor_ = static_cast<std::uint32_t>(speed);
    shift_ = static_cast<std::int16_t>(shift - halvings);
  }

  // Halves `value`, rounded up, until it fits into 32 bits. Returns the number of halvings.
  static constexpr int halve(std::uint64_t& value) {
    int halvings = 0;
    for (; value >> 32 != 0; ++halvings) value = (value >> 1) + (value & 1);
    return halvings;
  }

  // Returns the distance moved in the time `between`, in turns (linear: counts), times 2^bits.
  [[nodiscard]] constexpr std::uint64_t scaled(Time between, int bits) const {
    constexpr std::uint64_t most = ~std::uint64_t{0};
    auto time = static_cast<std::uint64_t>(between > Time{} ? between.count() : 0);
    const int shift = shift_ - bits - halve(time);
    const std::uint64_t product = std::uint64_t{factor_} * static_cast<std::uint32_t>(time);
    if (shift >= 0) return shift < 64 ? product >> shift : 0;
    if (product == 0) return 0;
    return shift > -64 && product <= most >> -shift ? product << -shift : most;
  }

  std::uint32_t factor_ = 0;  // speed limit in turns (linear: counts) per nanosecond, times 2^shift_
  std::int16_t shift_ = 0;
  bool turns_;
};

}  // namespace absenc::host
