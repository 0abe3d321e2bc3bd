// SPDX-License-Identifier: Apache-2.0
// Times of a Modbus RTU line (MODBUS over Serial Line V1.02, 2.5.1.1).
#pragma once

#include <cstdint>

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/author/engine.hpp"

namespace absenc::modbus {

using namespace std::chrono_literals;

/// Above this baud rate `frame_silence` and `character_gap` are constant, not a number of characters.
inline constexpr std::uint32_t fixed_times_above = 19'200;

/// Returns the silence that ends a frame: 3.5 characters, or 1750 us at high rates. The rate must not be 0.
[[nodiscard]] constexpr Time frame_silence(const LineSettings& line) {
  return line.rate > fixed_times_above ? 1750us : line.character() * 7 / 2;
}

/// Returns the silence that a client keeps before a request, which is more than `frame_silence`.
[[nodiscard]] constexpr Time request_silence(const LineSettings& line) {
  return frame_silence(line) + line.character() / 2;
}

/// Returns the longest silence within a frame: 1.5 characters, or 750 us at high rates.
[[nodiscard]] constexpr Time character_gap(const LineSettings& line) {
  return line.rate > fixed_times_above ? 750us : line.character() * 3 / 2;
}

/// Returns the timeouts of a client; a reply must begin within `answer_limit`.
[[nodiscard]] constexpr author::HostTimes client_times(const LineSettings& line, Time answer_limit) {
  return {.answer_limit = answer_limit + line.character(),
          .gap_limit = frame_silence(line),
          .silence = request_silence(line),
          // The limit `patience` is longer than any reply of the units that use these times.
          .patience = 1s};
}

}  // namespace absenc::modbus
