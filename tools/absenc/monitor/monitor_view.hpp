// SPDX-License-Identifier: Apache-2.0
// What `absenc monitor` shows: the list of all encoders, and everything about one of them.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "tools/absenc/monitor/screen.hpp"
#include "tools/absenc/monitor/watch.hpp"

namespace absenc::tool {

struct Shown {
  const Watch* watch;
  Snapshot snapshot;
};

struct View {
  std::vector<Shown> encoders;
  std::size_t selected = 0;
  bool paused = false;
  enum class Below : std::uint8_t { trace, errors, help } below = Below::trace;
  std::string question{};  // about the selected one, to be answered with y; "" when nothing is asked
};

inline constexpr int least_rows = 16;
inline constexpr int least_columns = 64;

/// Draws all of it; on a smaller screen than the least, only that it is too small.
void draw(Screen& screen, const View& view);

/// "elbow: 123.456 deg ..." for where there is no screen. What is not live is never shown as a value.
[[nodiscard]] std::string to_line(const Shown& shown);
[[nodiscard]] Json to_json(const Shown& shown);

}  // namespace absenc::tool
