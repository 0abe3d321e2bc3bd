// SPDX-License-Identifier: Apache-2.0
// In place of monitor/screen.cpp in programs that are built without ncurses: there is no screen, so `monitor` prints
// lines.
#include "tools/absenc/monitor/screen.hpp"

namespace absenc::tool {

struct Screen::Terminal {};

std::unique_ptr<Screen> Screen::open() { return nullptr; }

Screen::Screen(std::unique_ptr<Terminal> terminal) : terminal_(std::move(terminal)) {}
Screen::~Screen() = default;

int Screen::rows() const { return 0; }
int Screen::columns() const { return 0; }
void Screen::clear() {}
void Screen::put(int, int, std::string_view, Style) {}
void Screen::fill(int, std::string_view, Style) {}
void Screen::show() {}
KeyPress Screen::key(Time) { return KeyPress::quit; }

}  // namespace absenc::tool
