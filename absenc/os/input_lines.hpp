// SPDX-License-Identifier: Apache-2.0
// Non-blocking reading of lines, for input while a command does other work.
#pragma once

#include <string>
#include <vector>

namespace absenc::os {

class InputLines {
 public:
  /// Reads lines from `descriptor`, which is not closed here. If the descriptor is a terminal and this program runs in
  /// the background, nothing is read and the program is not stopped.
  explicit InputLines(int descriptor = 0);

  /// Returns the complete lines of one read, without their line ends. Never blocks. A line of 4096 bytes or more is
  /// returned in parts of 4096 bytes; the last part may be empty. At the end of the input an incomplete last line is
  /// returned.
  [[nodiscard]] std::vector<std::string> take();
  /// Returns whether the input has ended, or reading it failed.
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  int descriptor_;
  bool ended_ = false;
  std::string begun_;  // received bytes of a line that is not complete yet
};

}  // namespace absenc::os
