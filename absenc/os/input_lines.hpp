// SPDX-License-Identifier: Apache-2.0
// Non-blocking reading of lines, for input while a command does other work.
#pragma once

#include <string>
#include <vector>

namespace absenc::os {

class InputLines {
 public:
  /// Reads lines from `descriptor`, which is not closed here.
  explicit InputLines(int descriptor = 0);

  /// Returns the lines of one read without their ends; never blocks. Lines of more than 4096 bytes come in parts.
  [[nodiscard]] std::vector<std::string> take();
  /// Returns whether the input has ended, or reading it failed for good.
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  int descriptor_;
  bool ended_ = false;
  bool cut_ = false;   // whether the last line was cut at 4096 bytes
  std::string begun_;  // received bytes of a line that is not complete yet
};

}  // namespace absenc::os
