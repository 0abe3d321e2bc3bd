// SPDX-License-Identifier: Apache-2.0
// Speed limit of a shaft or carriage, and how far apart in place and time two readings may be.
#pragma once

#include <cstdint>

#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// Highest speed that a shaft or carriage is assumed to have.
struct SpeedLimit {
  /// Speed limit of rotary encoders in revolutions per minute.
  std::uint32_t rpm = 10'000;
  /// Speed limit of linear encoders in mm/s. Default: no linear axis is assumed to be faster.
  std::uint32_t mm_s = 20'000;
};

/// Multiple of the speed limit up to which a movement is too fast, but no jump.
inline constexpr unsigned most_excess = 4;

/// Returns the speed limit of the model in `options`, or else the default limit.
[[nodiscard]] constexpr SpeedLimit speed_limit(const Options& options) {
  SpeedLimit limit;
  if (options.model != nullptr && options.model->maximum_rpm != 0) limit.rpm = options.model->maximum_rpm;
  return limit;
}

/// Returns by how many counts the position changes in a second at the speed limit.
[[nodiscard]] constexpr double counts_per_second(const Resolution& resolution, const SpeedLimit& limit) {
  if (resolution.unit_um > 0) return limit.mm_s * 1000 / resolution.unit_um;
  const unsigned bits = resolution.singleturn_bits;
  return limit.rpm / 60.0 * (bits >= 63 ? 9.2e18 : static_cast<double>(std::uint64_t{1} << bits));
}

/// Returns the time in which the position changes by 15/32 of the counted range at the speed limit, at most `never`.
[[nodiscard]] constexpr Time longest_gap(const Resolution& resolution, const SpeedLimit& limit) {
  const bool linear = resolution.unit_um > 0;
  const unsigned bits = linear ? resolution.singleturn_bits : resolution.multiturn_bits;
  const double range =
      bits >= 63 ? 9.2e18
                 : static_cast<double>(std::uint64_t{1} << bits);  // counted range, in counts (linear) or turns
  // Speed limit in counts (linear) or turns per second.
  const double speed = linear ? limit.mm_s * 1000 / resolution.unit_um : limit.rpm / 60.0;
  const double nanoseconds = speed > 0 ? 15.0 / 32 * range / speed * 1e9 : 9.2e18;
  return nanoseconds < 9.2e18 ? Time(static_cast<std::int64_t>(nanoseconds)) : never;
}

/// The distance that a shaft or carriage can move in a given time at its speed limit.
class Reach {
 public:
  /// Returns the reach of a shaft of at most `rpm` revolutions per minute, limited to about 1 830 000.
  [[nodiscard]] static constexpr Reach of_shaft(std::uint32_t rpm) {
    constexpr std::uint32_t turns_a_ns_of_1_rpm = 2346;  // 1 rpm in turns per ns, times 2^47, rounded up by 0.016 %
    constexpr std::uint32_t fastest = 0xFFFF'FFFF / turns_a_ns_of_1_rpm;
    return {turns_a_ns_of_1_rpm * (rpm < fastest ? rpm : fastest), 47, true};
  }
  /// Returns the reach of a carriage of at most `mm_s` mm/s with counts of `unit_um` micrometres.
  [[nodiscard]] static constexpr Reach of_carriage(std::uint32_t mm_s, double unit_um) {
    double factor = mm_s / unit_um / 1e6;  // speed limit in counts per nanosecond
    std::int8_t shift = 0;
    for (; factor < 0x8000'0000 && shift < 100; factor *= 2) ++shift;
    return {factor < 0xFFFF'FFFF ? static_cast<std::uint32_t>(factor) + 1 : 0xFFFF'FFFF, shift, false};
  }
  /// Returns the reach of the shaft or carriage that `resolution` describes, within `limit`.
  [[nodiscard]] static constexpr Reach of(const SpeedLimit& limit, const Resolution& resolution) {
    return resolution.unit_um > 0 ? of_carriage(limit.mm_s, resolution.unit_um) : of_shaft(limit.rpm);
  }

  /// Returns by how many counts the position can change in the time `between`. `singleturn_bits`: 1 to 64.
  [[nodiscard]] constexpr std::uint64_t counts(Time between, unsigned singleturn_bits) const {
    auto time = static_cast<std::uint64_t>(between > Time{} ? between.count() : 0);
    int shift = turns_ ? shift_ - static_cast<int>(singleturn_bits) : shift_;
    for (; time >> 32 != 0; --shift) time = (time + 1) >> 1;
    const std::uint64_t product = std::uint64_t{factor_} * static_cast<std::uint32_t>(time);
    if (shift >= 0) return shift < 64 ? product >> shift : 0;
    constexpr std::uint64_t most = ~std::uint64_t{0};
    return product <= most >> -shift ? product << -shift : most;
  }

 private:
  constexpr Reach(std::uint32_t factor, std::int8_t shift, bool turns)
      : factor_(factor), shift_(shift), turns_(turns) {}

  std::uint32_t factor_;  // speed limit in turns (linear: counts) per nanosecond, times 2^shift_
  std::int8_t shift_;
  bool turns_;
};

}  // namespace absenc::host
