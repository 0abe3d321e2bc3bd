// SPDX-License-Identifier: Apache-2.0
// How fast a shaft or a carriage may be taken to move, and so how long readings may be apart to follow it.
#pragma once

#include <cstdint>

#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// There always is a limit: a pause joined on trust showed 0.40 turns for 10.40.
struct SpeedLimit {
  /// Where nobody says more: what the fastest encoders here are specified for, and faster than linear axes go.
  std::uint32_t rpm = 10'000;
  std::uint32_t mm_s = 20'000;  // linear encoders
};

/// The option's, or else the model's, or else the usual one.
[[nodiscard]] constexpr SpeedLimit speed_limit(const Unit& unit, const Options& options) {
  SpeedLimit limit;
  if (options.model != nullptr && options.model->maximum_rpm != 0) limit.rpm = options.model->maximum_rpm;
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    if (unit.options[i].role == Role::maximum_rpm && options[i] > 0) limit.rpm = static_cast<std::uint32_t>(options[i]);
  }
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

}  // namespace absenc::host
