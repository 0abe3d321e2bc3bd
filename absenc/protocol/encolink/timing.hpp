// SPDX-License-Identifier: Apache-2.0
// Times of EncoLink, as the host keeps them and the virtual encoder demands them.
#pragma once

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"

namespace absenc::encolink {

using namespace std::chrono_literals;

inline constexpr LineSettings uart_settings{.rate = 1'000'000};  // interface variant L
inline constexpr Time spi_lead = 5us;                            // t_s: NCS low to the first edge of SCK
// 4 MHz at most; CPOL 0, CPHA 1
inline constexpr LineSettings spi_settings{.rate = 1'000'000, .spi_mode = 1, .select_lead = spi_lead};
inline constexpr Time shortest_clock = 250ns;
inline constexpr Time spi_pause = 5us;  // t_p

// Not in the document. The virtual encoder answers that long after a request; the host waits generously.
inline constexpr Time answer_time = 5us;
inline constexpr Time answer_limit = 500us;
inline constexpr Time gap_limit = 30us;

inline constexpr Time start_up = 100ms;  // of well-formed zeros; assumed
inline constexpr Time save_time = 50ms;  // busy; assumed
inline constexpr Time busy_limit = 2s;
inline constexpr Time calibration_time = 1s;    // of the virtual encoder's shaft
inline constexpr Time calibration_limit = 15s;  // the vendor allows the shaft 10 s
inline constexpr Time calibration_poll = 100ms;
inline constexpr Time listen_limit = 500ms;  // without a good frame of an encoder that transmits by itself

}  // namespace absenc::encolink
