// SPDX-License-Identifier: Apache-2.0
// A pseudo-terminal: what is written to one of its two ends is read from the other.
#pragma once

#include <string>

#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// The two ends of a pseudo-terminal. Both are open, non-blocking, and closed in child programs.
struct TerminalPair {
  Descriptor master{};
  Descriptor slave{};
  std::string path{};  ///< path of the slave: "/dev/pts/3"
};

/// Returns a new pseudo-terminal in raw mode. Throws Failure.
[[nodiscard]] TerminalPair open_terminal_pair();

}  // namespace absenc::os
