// SPDX-License-Identifier: Apache-2.0
// A terminal that is drawn on as a whole. The library behind it is seen by screen.cpp alone: its macros are many.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "absenc/core/time.hpp"

namespace absenc::tool {

enum class Style : std::uint8_t { plain, faint, bold, title, good, warning, bad };

enum class Key : std::uint8_t {
  none,
  quit,
  pause,
  zero,
  clear_alarms,
  next,
  previous,
  errors,
  help,
  yes,
  other,
  resized,
};

class Screen {
 public:
  /// Takes the terminal of standard input and output. Null when it is none that can be drawn on.
  [[nodiscard]] static std::unique_ptr<Screen> open();
  /// Gives the terminal back as it was.
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  [[nodiscard]] int rows() const;
  [[nodiscard]] int columns() const;

  void clear();
  /// What lies outside the screen is cut off. Bytes that cannot be shown become '?'.
  void put(int row, int column, std::string_view text, Style style = Style::plain);
  /// The rest of the row too gets the style.
  void fill(int row, std::string_view text, Style style);
  void show();

  /// Waits for a key no longer than `limit`.
  [[nodiscard]] Key key(Time limit);

 private:
  struct Terminal;
  explicit Screen(std::unique_ptr<Terminal> terminal);
  std::unique_ptr<Terminal> terminal_;
};

}  // namespace absenc::tool
