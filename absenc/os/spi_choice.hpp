// SPDX-License-Identifier: Apache-2.0
// SPI modes, and the user's choice of clock rate and SPI mode for a port that clocks.
#pragma once

#include <cstdint>
#include <optional>

namespace absenc::os {

/// Returns whether the clock rests high in this SPI mode, 2 * CPOL + CPHA.
[[nodiscard]] constexpr bool idles_high(std::uint8_t mode) { return (mode & 2) != 0; }

/// Settings chosen by the user, which override those of the protocol.
struct SpiChoice {
  std::optional<std::uint32_t> speed;  // clock rate in Hz
  std::optional<std::uint8_t> mode;    // SPI mode, 0 to 3
};

}  // namespace absenc::os
