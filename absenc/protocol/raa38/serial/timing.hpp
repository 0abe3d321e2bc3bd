// SPDX-License-Identifier: Apache-2.0
// Times of the RAA38S6 on asynchronous lines. The document states T2 and nothing else; the rest is ours.
#pragma once

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"

namespace absenc::raa38::serial {

using namespace std::chrono_literals;

inline constexpr LineSettings line_settings{.rate = 0};  // "T1: baud rate": not stated, must be given

inline constexpr Time trigger_width = 10us;  // T2, at least (3.1.3)
inline constexpr Time clear_width = 1ms;     // of the pulse on CLR

// How long a host waits, when the options do not say what was ordered.
inline constexpr Time answer_limit = 100ms;  // T3, and from a request to its answer
inline constexpr Time answer_slack = 5ms;    // beyond a T3 that is given
inline constexpr Time gap_limit = 10ms;      // between characters: 1200 baud
inline constexpr Time patience = 1s;         // with a line that is never silent: two frames at 1200 baud are 130 ms
inline constexpr Time listen_limit = 1s;     // without a good frame of an encoder that transmits by itself
inline constexpr Time scan_silence = 200ms;  // before a scan: longer than most refresh rates take
inline constexpr Time zero_limit = 500ms;    // until the position must be zero
inline constexpr Time zero_poll = 10ms;

// The virtual encoder, where the options do not say.
inline constexpr Time virtual_period = 10ms;        // refresh rate 100 Hz
inline constexpr Time virtual_acquisition = 100us;  // T3
inline constexpr Time most_backlog = 50ms;          // a stream that was held up longer leaves frames out
inline constexpr Time request_gap = 2ms;            // after which the beginning of a request is forgotten

}  // namespace absenc::raa38::serial
