// SPDX-License-Identifier: Apache-2.0
// Draws text on a terminal and reads its keys. Only screen.cpp may include ncurses.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "absenc/core/time.hpp"

namespace absenc::tool {

enum class Style : std::uint8_t { plain, faint, bold, title, good, warning, bad };

enum class KeyPress : std::uint8_t {
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
  /// Takes over the terminal. Returns null if the terminal cannot be used as a screen.
  [[nodiscard]] static std::unique_ptr<Screen> open();
  /// Restores the terminal to its state before `open`.
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  [[nodiscard]] int rows() const;
  [[nodiscard]] int columns() const;

  void clear();
  /// Draws `text`, cut at the right edge, with '?' for all but printable ASCII.
  void put(int row, int column, std::string_view text, Style style = Style::plain);
  /// Draws `text` from the left edge on, and gives the whole row the style `style`.
  void fill(int row, std::string_view text, Style style);
  void show();

  /// Waits at most `limit` for the next key. Returns KeyPress::none if no key was pressed.
  [[nodiscard]] KeyPress key(Time limit);

 private:
  struct Terminal;
  explicit Screen(std::unique_ptr<Terminal> terminal);
  std::unique_ptr<Terminal> terminal_;
};

}  // namespace absenc::tool
