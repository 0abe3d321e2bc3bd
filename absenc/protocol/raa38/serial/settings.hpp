// SPDX-License-Identifier: Apache-2.0
// How an RAA38S6 was ordered: what its options mean to host and virtual encoder.
#pragma once

#include <cstdint>

#include "absenc/protocol/raa38/serial/frame.hpp"
#include "absenc/protocol/raa38/serial/timing.hpp"

namespace absenc::raa38::serial {

struct Settings {
  Format format{};
  Mode mode = Mode::timing;
  std::uint8_t unit = 1;
  Zeroing zeroing = Zeroing::none;
  std::uint8_t zero_unit = 1;
  Time period{};                  // of the refresh rate; 0: not known
  std::uint32_t maximum_rpm = 0;  // 0: positions may jump
  Time acquisition{};             // T3, or from a request to its answer; 0: not known
  Time transmission{};            // T1 - T3, of a frame; 0: as long as its characters take

  /// Of frames that nobody asked for.
  [[nodiscard]] constexpr std::uint8_t second_byte() const {
    if (format.second_byte != SecondByte::echo) return fixed_second_byte;
    return static_cast<std::uint8_t>(number_mark | unit);
  }
};

/// Whether a shaft can have turned so far in that time, with a little for noise.
[[nodiscard]] constexpr bool is_possible(const Settings& settings, std::uint32_t from, std::uint32_t to, Time between) {
  const std::int64_t moved = wrapped_difference(to, from, settings.format.bits);
  const double revolutions = settings.maximum_rpm * static_cast<double>(between.count()) / 60e9;
  const double allowed = 4 + revolutions * static_cast<double>(std::uint64_t{1} << settings.format.bits);
  return static_cast<double>(moved < 0 ? -moved : moved) <= allowed;
}

}  // namespace absenc::raa38::serial
