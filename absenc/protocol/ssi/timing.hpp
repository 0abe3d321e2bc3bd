// SPDX-License-Identifier: Apache-2.0
// Times of SSI, as the RAA38S6 manual (3.5) gives them; other encoders differ.
#pragma once

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"

namespace absenc::ssi {

using namespace std::chrono_literals;

inline constexpr LineSettings line_settings{.rate = 200'000, .spi_mode = 3, .idle_clocks = 1};
/// What varies by product (3.5, note).
struct Timing {
  Time pause = 500us;          // Tm: more than that between two words, or the old one goes on
  Time shortest_period = 4us;  // 250 kHz, which is also what Tcs says
  Time longest_period = 10us;  // 100 kHz
};

inline constexpr Time pause_margin = 10us;  // what the host leaves on top

}  // namespace absenc::ssi
