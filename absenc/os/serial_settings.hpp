// SPDX-License-Identifier: Apache-2.0
// Line settings of a terminal device with any baud rate (termios2).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/link/line.hpp"

namespace absenc::os {

/// The settings of a terminal: the kernel's struct termios2, saved to be restored.
using TerminalState = std::array<std::byte, 44>;

/// Returns the settings of the terminal; empty if `descriptor` is no terminal.
[[nodiscard]] std::optional<TerminalState> terminal_state(int descriptor);

/// Returns the bit rate of the terminal, in bits per second; 0 if `descriptor` is no terminal.
[[nodiscard]] std::uint32_t terminal_rate(int descriptor);

/// Restores the saved settings of a terminal after all written bytes were sent. Ignores errors.
void restore_terminal(int descriptor, const TerminalState& state);

/// Waits until all written bytes were sent, then sets raw mode and `settings`. Returns the settings that the driver
/// has applied; nothing on error, with errno set.
std::optional<LineSettings> set_terminal(int descriptor, const LineSettings& settings);

/// Returns whether the bit rate `given` differs from `requested` by at most 1 %.
[[nodiscard]] constexpr bool rates_agree(std::uint32_t requested, std::uint32_t given) {
  const std::uint64_t difference = requested > given ? requested - given : given - requested;
  return difference * 100 <= requested;
}

/// Returns the bit rate to propose to the user when the driver applied `given` instead of `requested`, which is not
/// 0. `base`: highest rate of the baud generator, which divides it by whole numbers; 0 if unknown.
[[nodiscard]] constexpr std::uint32_t nearest_rate(std::uint32_t requested, std::uint32_t given, std::uint32_t base) {
  const auto distance = [requested](std::uint32_t rate) {
    return rate > requested ? rate - requested : requested - rate;
  };
  std::uint32_t nearest = given;
  const std::uint32_t divisor = base / requested;
  for (const std::uint32_t candidate : {divisor, divisor + 1}) {
    if (candidate == 0 || base < candidate) continue;
    const std::uint32_t rate = base / candidate;
    // `base` is wrong if the requested rate is one of its quotients, because the driver has just refused this rate.
    if (rates_agree(requested, rate)) return given;
    if (distance(rate) < distance(nearest)) nearest = rate;
  }
  return nearest;
}

}  // namespace absenc::os
