// SPDX-License-Identifier: Apache-2.0
// Line settings of a terminal device, any baud rate. Apart from serial.cpp because the kernel's <asm/termbits.h>
// (termios2, BOTHER) clashes with <termios.h>.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/link/line.hpp"

namespace absenc::os {

/// The kernel's struct termios2, kept to be restored.
using TerminalState = std::array<std::byte, 44>;

/// Empty when the descriptor is no terminal.
[[nodiscard]] std::optional<TerminalState> terminal_state(int descriptor);

/// What somebody set it to, in bits a second; 0 when the descriptor is no terminal.
[[nodiscard]] std::uint32_t terminal_rate(int descriptor);

/// After what was written has left. Errors are ignored: the port may be gone.
void restore_terminal(int descriptor, const TerminalState& state);

/// Raw mode, 8 data bits, no flow control, and `settings`, after what was written has left. Returns what the driver
/// made of them, which need not be the same; nothing with an error in errno.
std::optional<LineSettings> set_terminal(int descriptor, const LineSettings& settings);

/// Whether a UART at one rate understands one at the other: not more than 1 % apart. (Each end may be 2 to 3 % off
/// before a 10-bit character breaks; the encoder needs its share.)
[[nodiscard]] constexpr bool rates_agree(std::uint32_t asked, std::uint32_t given) {
  const std::uint64_t difference = asked > given ? asked - given : given - asked;
  return difference * 100 <= asked;
}

/// The rate to propose when the driver gave another than `asked`: that one, or the nearest that divides `base` (0:
/// unknown), the input clock of its baud generator, because drivers fall back to 9600 rather than to the nearest.
[[nodiscard]] constexpr std::uint32_t nearest_rate(std::uint32_t asked, std::uint32_t given, std::uint32_t base) {
  const auto distance = [asked](std::uint32_t rate) { return rate > asked ? rate - asked : asked - rate; };
  std::uint32_t nearest = given;
  const std::uint32_t divisor = base / asked;
  for (const std::uint32_t candidate : {divisor, divisor + 1}) {
    if (candidate == 0 || base < candidate) continue;
    const std::uint32_t rate = base / candidate;
    // A base that promises what the driver has just refused is made up.
    if (rates_agree(asked, rate)) return given;
    if (distance(rate) < distance(nearest)) nearest = rate;
  }
  return nearest;
}

}  // namespace absenc::os
