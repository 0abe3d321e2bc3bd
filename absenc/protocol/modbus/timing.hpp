// SPDX-License-Identifier: Apache-2.0
// Times of a Modbus RTU line: frames are told apart by silence (MODBUS over Serial Line V1.02, 2.5.1.1).
#pragma once

#include <cstdint>

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/author/engine.hpp"

namespace absenc::modbus {

using namespace std::chrono_literals;

/// Above this rate the silences no longer shrink with the characters.
inline constexpr std::uint32_t fixed_times_above = 19'200;

/// 3.5 characters: at least so much lies between two frames, and so much ends a frame. `rate` must not be 0.
[[nodiscard]] constexpr Time frame_silence(const LineSettings& line) {
  return line.rate > fixed_times_above ? 1750us : line.character() * 7 / 2;
}

/// What a client keeps before a request: half a character more, for servers that measure a little long.
[[nodiscard]] constexpr Time request_silence(const LineSettings& line) {
  return frame_silence(line) + line.character() / 2;
}

/// 1.5 characters: at most so much lies between two characters of a frame.
[[nodiscard]] constexpr Time character_gap(const LineSettings& line) {
  return line.rate > fixed_times_above ? 750us : line.character() * 3 / 2;
}

/// How a client speaks on a line as it is set: `answer_limit` after a request the reply has begun.
[[nodiscard]] constexpr author::HostTimes client_times(const LineSettings& line, Time answer_limit) {
  return {.answer_limit = answer_limit + line.character(),
          .gap_limit = frame_silence(line),
          .silence = request_silence(line),
          .patience = 1s};  // longer than any reply, and than carriers are late to tell silence
}

}  // namespace absenc::modbus
