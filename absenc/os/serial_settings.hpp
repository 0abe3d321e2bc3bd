// SPDX-License-Identifier: Apache-2.0
// Line settings of a terminal device with any baud rate. Separate from serial.cpp, because the kernel's
// <asm/termbits.h> (termios2, BOTHER) clashes with <termios.h>.
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

/// Restores the saved settings of a terminal after all written bytes have been sent. Errors are ignored: the port may
/// have disappeared.
void restore_terminal(int descriptor, const TerminalState& state);

/// Sets raw mode, no flow control, and `settings` with up to 8 data bits, after all written bytes have been sent.
/// Returns the settings that the driver has applied, which may differ; nothing on error, with errno set.
std::optional<LineSettings> set_terminal(int descriptor, const LineSettings& settings);

/// Returns whether `given` differs from `requested` by at most 1 %, so that UARTs at the two rates understand each
/// other. (Each end may be 2 to 3 % off before a 10-bit character breaks; the encoder needs its share.)
[[nodiscard]] constexpr bool rates_agree(std::uint32_t requested, std::uint32_t given) {
  const std::uint64_t difference = requested > given ? requested - given : given - requested;
  return difference * 100 <= requested;
}

/// Returns the rate to propose when the driver gave the rate `given` instead of `requested`: the nearest of `given` and
/// of `base` divided by a whole number. `base` is the input clock of the baud generator, 0 if unknown; it is ignored if
/// it could give `requested`, because the driver did not.
[[nodiscard]] constexpr std::uint32_t nearest_rate(std::uint32_t requested, std::uint32_t given, std::uint32_t base) {
  const auto distance = [requested](std::uint32_t rate) {
    return rate > requested ? rate - requested : requested - rate;
  };
  std::uint32_t nearest = given;
  const std::uint32_t divisor = base / requested;
  for (const std::uint32_t candidate : {divisor, divisor + 1}) {
    if (candidate == 0 || base < candidate) continue;
    const std::uint32_t rate = base / candidate;
    // If `base` promises a rate that the driver has just refused, `base` is wrong.
    if (rates_agree(requested, rate)) return given;
    if (distance(rate) < distance(nearest)) nearest = rate;
  }
  return nearest;
}

}  // namespace absenc::os
