// SPDX-License-Identifier: Apache-2.0
// Draws the screen of `absenc monitor`.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "tools/absenc/monitor/screen.hpp"
#include "tools/absenc/monitor/watch.hpp"

namespace absenc::tool {

struct MonitoredEncoder {
  const Watch* watch;
  Snapshot snapshot;
};

struct View {
  std::vector<MonitoredEncoder> encoders;
  std::size_t selected = 0;
  bool paused = false;
  enum class Below : std::uint8_t { trace, errors, help } below = Below::trace;
  std::string question{};  // question about the selected encoder, to be answered with y; "": no question
};

inline constexpr int least_rows = 16;
inline constexpr int least_columns = 64;

/// Draws the whole screen of `view`, or a message that the screen is too small.
void draw(Screen& screen, const View& view);

/// Returns the encoder's state as one line "elbow: 123.456 deg ..."; without values if the reading is not live.
[[nodiscard]] std::string to_line(const MonitoredEncoder& shown);
[[nodiscard]] Json to_json(const MonitoredEncoder& shown);

}  // namespace absenc::tool
