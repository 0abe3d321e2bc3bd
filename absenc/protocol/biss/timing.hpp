// SPDX-License-Identifier: Apache-2.0
// Times of BiSS-C and what they make of the samples.
#pragma once

#include <algorithm>
#include <cstdint>

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/biss/frame.hpp"

namespace absenc::biss {

using namespace std::chrono_literals;

inline constexpr LineSettings line_settings{.rate = 1'000'000, .spi_mode = 3};
inline constexpr Time shortest_period = 100ns;  // of MA: 10 MHz
inline constexpr Time timeout_maximum = 40us;   // SLO stays low for 12.5 to 40 us after the last clock

/// ACK bits of an encoder that needs `latency` from the second rising edge of MA until its position is ready.
[[nodiscard]] constexpr unsigned ack_bits(Time latency, Time period) {
  return std::max(1u, static_cast<unsigned>((latency + period - 1ns) / period));
}

/// Clocks that a whole frame needs.
[[nodiscard]] constexpr unsigned clocks(const Format& format, Time latency, Time period) {
  return idle_bits + ack_bits(latency, period) + 2 + data_bits(format);
}

}  // namespace absenc::biss
