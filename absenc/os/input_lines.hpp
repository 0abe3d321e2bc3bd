// SPDX-License-Identifier: Apache-2.0
// Lines that somebody writes while something else goes on: looked for, never waited for.
#pragma once

#include <string>
#include <vector>

namespace absenc::os {

class InputLines {
 public:
  /// `descriptor` stays the caller's. Of a terminal: while it belongs to another program, because this one runs in the
  /// background, nothing is taken from it, and this one goes on.
  explicit InputLines(int descriptor = 0);

  /// The whole lines that are there, without their ends, as far as one read brings them. Never blocks. What stands
  /// behind the last line end when the input ends is a line too.
  [[nodiscard]] std::vector<std::string> take();
  /// Nothing comes any more.
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  int descriptor_;
  bool ended_ = false;
  std::string begun_;  // a line that is not whole yet
};

}  // namespace absenc::os
