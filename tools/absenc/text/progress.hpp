// SPDX-License-Identifier: Apache-2.0
// Shows the progress of long work on the last line of the terminal, if there is one.
#pragma once

#include <string_view>

#include "absenc/os/process.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

class Progress {
 public:
  Progress() : visible_(os::is_terminal(2)) {}
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  [[nodiscard]] bool visible() const { return visible_; }
  /// Replaces the shown text by `text`. Until `clear` is called, nothing else may be printed.
  void show(std::string_view text) {
    if (!visible_) return;
    print_prompt("\r\033[K");
    print_prompt(text);
    shown_ = true;
  }
  void clear() {
    if (shown_) print_prompt("\r\033[K");
    shown_ = false;
  }

 private:
  bool visible_;
  bool shown_ = false;
};

}  // namespace absenc::tool
