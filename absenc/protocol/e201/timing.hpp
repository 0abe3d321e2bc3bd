// SPDX-License-Identifier: Apache-2.0
// Times of the E201-9S. No document gives any: the adapter clocks 64 bits and answers as fast as USB does.
#pragma once

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/e201/frame.hpp"

namespace absenc::e201 {

using namespace std::chrono_literals;

/// A virtual COM port: the rate means nothing to the adapter.
inline constexpr LineSettings line_settings{.rate = 115'200};

inline constexpr Time answer_limit = 50ms;   // 64 clocks at 35 kHz are 1.8 ms
inline constexpr Time gap_limit = 20ms;      // within a reply
inline constexpr Time reply_limit = 100ms;   // a reply is over then, whatever still comes
inline constexpr Time silent_limit = 10ms;   // a command that may have no reply has none
inline constexpr Time supply_time = 200ms;   // until the encoder is up, or the supply down, after `n` and `f`
inline constexpr Time between_looks = 10ms;  // two positions that far apart show whether the encoder moves

/// One period of MA at clock 1 to 8.
[[nodiscard]] constexpr Time clock_period(unsigned clock) {
  return LineSettings{.rate = clocks_khz[clock - 1] * 1000u}.bits(1);
}

}  // namespace absenc::e201
