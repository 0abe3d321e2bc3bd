// SPDX-License-Identifier: Apache-2.0
// Speed limit of a shaft or a carriage: how far apart two positions can be after a time, and how long the time between
// readings may be.
#pragma once

#include <cstdint>

#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// There always is a limit: a pause that was bridged without one showed 0.40 turns for 10.40.
struct SpeedLimit {
  /// The default: the specified speed of the fastest supported encoders; no linear axis is faster.
  std::uint32_t rpm = 10'000;
  std::uint32_t mm_s = 20'000;  ///< speed of linear encoders, in mm/s
};

/// A speed up to this multiple of the limit is too fast, but no jump.
inline constexpr unsigned most_excess = 4;

/// Returns the limit of the model, or else the default.
[[nodiscard]] constexpr SpeedLimit speed_limit(const Options& options) {
  SpeedLimit limit;
  if (options.model != nullptr && options.model->maximum_rpm != 0) limit.rpm = options.model->maximum_rpm;
  return limit;
}

/// Returns the counts that pass in a second at the limit.
[[nodiscard]] constexpr double counts_per_second(const Resolution& resolution, const SpeedLimit& limit) {
  if (resolution.unit_um > 0) return limit.mm_s * 1000 / resolution.unit_um;
  const unsigned bits = resolution.singleturn_bits;
  return limit.rpm / 60.0 * (bits >= 63 ? 9.2e18 : static_cast<double>(std::uint64_t{1} << bits));
}

/// Returns the time that readings must be closer than: at the limit the position changes by half of the counted range
/// in it, less 1/16 for noise and for latch times that are not known to the microsecond. `never` for a limit of 0.
[[nodiscard]] constexpr Time longest_gap(const Resolution& resolution, const SpeedLimit& limit) {
  const bool linear = resolution.unit_um > 0;
  const unsigned bits = linear ? resolution.singleturn_bits : resolution.multiturn_bits;
  const double range = bits >= 63 ? 9.2e18 : static_cast<double>(std::uint64_t{1} << bits);  // in counts, or turns
  // In counts, or turns, per second.
  const double speed = linear ? limit.mm_s * 1000 / resolution.unit_um : limit.rpm / 60.0;
  const double nanoseconds = speed > 0 ? 15.0 / 32 * range / speed * 1e9 : 9.2e18;
  return nanoseconds < 9.2e18 ? Time(static_cast<std::int64_t>(nanoseconds)) : never;
}

/// Counts that pass in a time at the speed limit. Uses integers, because a small processor has no floating point.
class Reach {
 public:
  /// Returns the reach of a shaft. `rpm` up to 1 830 000; higher speeds count as that.
  [[nodiscard]] static constexpr Reach of_shaft(std::uint32_t rpm) {
    constexpr std::uint32_t turns_a_ns_of_1_rpm = 2346;  // 2^47 / 60e9, rounded up by 0.016 %
    constexpr std::uint32_t fastest = 0xFFFF'FFFF / turns_a_ns_of_1_rpm;
    return {turns_a_ns_of_1_rpm * (rpm < fastest ? rpm : fastest), 47, true};
  }
  /// Returns the reach of a carriage whose encoder counts `unit_um` micrometres. Uses floating point, once.
  [[nodiscard]] static constexpr Reach of_carriage(std::uint32_t mm_s, double unit_um) {
    double factor = mm_s / unit_um / 1e6;  // counts per nanosecond
    std::int8_t shift = 0;
    for (; factor < 0x8000'0000 && shift < 100; factor *= 2) ++shift;
    return {factor < 0xFFFF'FFFF ? static_cast<std::uint32_t>(factor) + 1 : 0xFFFF'FFFF, shift, false};
  }
  /// Returns how far a shaft can move under `limit`, in counts of `resolution`.
  [[nodiscard]] static constexpr Reach of(const SpeedLimit& limit, const Resolution& resolution) {
    return resolution.unit_um > 0 ? of_carriage(limit.mm_s, resolution.unit_um) : of_shaft(limit.rpm);
  }

  /// Returns the counts that pass in this time, at most what 64 bits hold. `singleturn_bits`: 1 to 64.
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

  std::uint32_t factor_;  // turns, or counts, times 2^shift, per nanosecond
  std::int8_t shift_;
  bool turns_;
};

}  // namespace absenc::host
