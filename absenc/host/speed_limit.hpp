// SPDX-License-Identifier: Apache-2.0
// How fast a shaft or a carriage may be taken to move: how far apart two positions can be after a time, and how long
// readings may be apart to follow it.
#pragma once

#include <cstdint>

#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// There always is a limit: a pause joined on trust showed 0.40 turns for 10.40.
struct SpeedLimit {
  /// Where nobody says more: what the fastest encoders here are specified for, and faster than linear axes go.
  std::uint32_t rpm = 10'000;
  std::uint32_t mm_s = 20'000;  ///< linear encoders
};

/// Up to so many times its limit a shaft is too fast, but has not jumped.
inline constexpr unsigned most_excess = 4;

/// The model's, or else the usual one.
[[nodiscard]] constexpr SpeedLimit speed_limit(const Options& options) {
  SpeedLimit limit;
  if (options.model != nullptr && options.model->maximum_rpm != 0) limit.rpm = options.model->maximum_rpm;
  return limit;
}

/// How many counts the fastest goes in a second.
[[nodiscard]] constexpr double counts_per_second(const Resolution& resolution, const SpeedLimit& limit) {
  if (resolution.unit_um > 0) return limit.mm_s * 1000 / resolution.unit_um;
  const unsigned bits = resolution.singleturn_bits;
  return limit.rpm / 60.0 * (bits >= 63 ? 9.2e18 : static_cast<double>(std::uint64_t{1} << bits));
}

/// Readings must be nearer to each other than this: how long the fastest takes for half of what the encoder counts,
/// less a sixteenth for noise and for not knowing to the microsecond when a position was taken. With a limit of 0 it
/// stands still: `never`.
[[nodiscard]] constexpr Time longest_gap(const Resolution& resolution, const SpeedLimit& limit) {
  const bool linear = resolution.unit_um > 0;
  const unsigned bits = linear ? resolution.singleturn_bits : resolution.multiturn_bits;
  const double range = bits >= 63 ? 9.2e18 : static_cast<double>(std::uint64_t{1} << bits);  // counts, or turns
  const double speed = linear ? limit.mm_s * 1000 / resolution.unit_um : limit.rpm / 60.0;   // of them a second
  const double nanoseconds = speed > 0 ? 15.0 / 32 * range / speed * 1e9 : 9.2e18;
  return nanoseconds < 9.2e18 ? Time(static_cast<std::int64_t>(nanoseconds)) : never;
}

/// How many counts the fastest goes in a time, by integers: a small processor has no floating point.
class Reach {
 public:
  /// `rpm` up to 1 830 000; more counts as that.
  [[nodiscard]] static constexpr Reach of_shaft(std::uint32_t rpm) {
    constexpr std::uint32_t turns_a_ns_of_1_rpm = 2346;  // 2^47 / 60e9, rounded up by 0.016 %
    constexpr std::uint32_t fastest = 0xFFFF'FFFF / turns_a_ns_of_1_rpm;
    return {turns_a_ns_of_1_rpm * (rpm < fastest ? rpm : fastest), 47, true};
  }
  /// Of a carriage whose encoder counts `unit_um` micrometres. Calculates with floating point, once.
  [[nodiscard]] static constexpr Reach of_carriage(std::uint32_t mm_s, double unit_um) {
    double factor = mm_s / unit_um / 1e6;  // counts a nanosecond
    std::int8_t shift = 0;
    for (; factor < 0x8000'0000 && shift < 100; factor *= 2) ++shift;
    return {factor < 0xFFFF'FFFF ? static_cast<std::uint32_t>(factor) + 1 : 0xFFFF'FFFF, shift, false};
  }
  /// Returns how far a shaft can move under `limit`, in counts of `resolution`.
  [[nodiscard]] static constexpr Reach of(const SpeedLimit& limit, const Resolution& resolution) {
    return resolution.unit_um > 0 ? of_carriage(limit.mm_s, resolution.unit_um) : of_shaft(limit.rpm);
  }

  /// The most that 64 bits hold if it is more. `singleturn_bits` 1 to 64.
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

  std::uint32_t factor_;  // turns, or counts, of 2^-shift in a nanosecond
  std::int8_t shift_;
  bool turns_;
};

}  // namespace absenc::host
