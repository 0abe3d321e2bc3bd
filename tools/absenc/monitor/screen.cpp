// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/monitor/screen.hpp"

#define NCURSES_NOMACROS  // makes curses.h declare erase, timeout and others as functions instead of macros
#include <curses.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>

#include "absenc/os/process.hpp"

namespace absenc::tool {

struct Screen::Terminal {
  SCREEN* screen = nullptr;
  bool colours = false;
  attr_t attributes = ~attr_t{0};  // the attributes that the terminal can show
};

namespace {

struct TextAttributes {
  attr_t attributes;
  short colour;  // colour of the text, which is also the number of the colour pair; 0: the default colour
};

// Attributes of text, indexed by Style. Terminals without colours show only the attributes.
constexpr std::array<TextAttributes, 7> looks{{{A_NORMAL, 0},
                                               {A_DIM, 0},
                                               {A_BOLD, 0},
                                               {A_REVERSE, 0},
                                               {A_NORMAL, COLOR_GREEN},
                                               {A_BOLD, COLOR_YELLOW},
                                               {A_BOLD, COLOR_RED}}};

attr_t attributes_of(Style style, attr_t allowed, bool colours) {
  const TextAttributes& look = looks[static_cast<std::size_t>(style)];
  return (look.attributes & allowed) | (colours && look.colour != 0 ? static_cast<attr_t>(COLOR_PAIR(look.colour)) : 0);
}

std::string shown(std::string_view text, std::size_t width) {
  std::string line(text.substr(0, width));
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return line;
}

KeyPress key_of(int key) {
  switch (key) {
    case ERR:
      return KeyPress::none;
    case 'q':
    case 'Q':
      return KeyPress::quit;
    case ' ':
    case 'p':
      return KeyPress::pause;
    case 'z':
      return KeyPress::zero;
    case 'c':
      return KeyPress::clear_alarms;
    case 'n':
    case '\t':
    case KEY_DOWN:
      return KeyPress::next;
    case KEY_UP:
    case KEY_BTAB:
      return KeyPress::previous;
    case 'e':
      return KeyPress::errors;
    case 'h':
    case '?':
      return KeyPress::help;
    case 'y':
    case 'Y':
      return KeyPress::yes;
    case KEY_RESIZE:
      return KeyPress::resized;
    default:
      return KeyPress::other;
  }
}

bool wants_colours() {
  // If the environment variable NO_COLOR is set and not empty, no colours are used: https://no-color.org.
  const char* const no_color = std::getenv("NO_COLOR");
  return no_color == nullptr || *no_color == '\0';
}

}  // namespace

std::unique_ptr<Screen> Screen::open() {
  if (!os::is_terminal(0) || !os::is_terminal(1)) return nullptr;
  auto terminal = std::make_unique<Terminal>();
  ::set_escdelay(25);
  const os::TerminalKind kind = os::terminal_kind();
  if (!kind.has_faint_text) terminal->attributes &= ~attr_t{A_DIM};
  terminal->screen = ::newterm(kind.name, stdout, stdin);
  if (terminal->screen == nullptr) return nullptr;
  if (::tigetstr("cup") == nullptr) {  // the terminal, for example with TERM=dumb, cannot move the cursor
    ::endwin();
    ::delscreen(terminal->screen);
    return nullptr;
  }
  ::cbreak();
  ::noecho();
  ::keypad(stdscr, TRUE);
  ::curs_set(0);
  terminal->colours = wants_colours() && ::has_colors() && ::start_color() == OK;
  if (terminal->colours) {
    ::use_default_colors();
    for (const TextAttributes& look : looks) {
      if (look.colour != 0) ::init_pair(look.colour, look.colour, -1);
    }
  }
  return std::unique_ptr<Screen>(new Screen(std::move(terminal)));
}

Screen::Screen(std::unique_ptr<Terminal> terminal) : terminal_(std::move(terminal)) {}

Screen::~Screen() {
  ::endwin();
  ::delscreen(terminal_->screen);
}

int Screen::rows() const { return getmaxy(stdscr); }
int Screen::columns() const { return getmaxx(stdscr); }

void Screen::clear() { ::erase(); }

void Screen::put(int row, int column, std::string_view text, Style style) {
  if (row < 0 || row >= rows() || column < 0 || column >= columns()) return;
  ::attrset(static_cast<int>(attributes_of(style, terminal_->attributes, terminal_->colours)));
  ::mvaddstr(row, column, shown(text, static_cast<std::size_t>(columns() - column)).c_str());
  ::attrset(A_NORMAL);
}

void Screen::fill(int row, std::string_view text, Style style) {
  std::string line(text);
  line.resize(static_cast<std::size_t>(columns()), ' ');
  put(row, 0, line, style);
}

void Screen::show() { ::refresh(); }

KeyPress Screen::key(Time limit) {
  ::timeout(static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(limit).count()));
  return key_of(::getch());
}

}  // namespace absenc::tool
