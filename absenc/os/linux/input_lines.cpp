// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/input_lines.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <utility>

namespace absenc::os {

namespace {
constexpr std::size_t longest_line = 4096;
}

// SIGTTIN is ignored: reading the terminal from the background then fails with EIO instead of stopping the program.
InputLines::InputLines(int descriptor) : descriptor_(descriptor) {
  if (::isatty(descriptor) == 1) static_cast<void>(::signal(SIGTTIN, SIG_IGN));
}

std::vector<std::string> InputLines::take() {
  std::vector<std::string> lines;
  pollfd readable{descriptor_, POLLIN, 0};
  if (ended_ || ::poll(&readable, 1, 0) <= 0) return lines;
  std::array<char, longest_line> read{};
  const ssize_t size = ::read(descriptor_, read.data(), read.size());
  if (size < 0 && (errno == EIO || errno == EAGAIN || errno == EINTR)) return lines;
  ended_ = size <= 0;
  for (ssize_t i = 0; i < size; ++i) {
    const char c = read[static_cast<std::size_t>(i)];
    const bool ends = c == '\n';
    if (!ends) begun_ += c;
    // The line feed of a line that was cut at 4096 bytes begins no new line.
    const bool was_cut = std::exchange(cut_, begun_.size() == longest_line);
    if (cut_ || (ends && !was_cut)) lines.push_back(std::exchange(begun_, {}));
  }
  if (ended_ && !begun_.empty()) lines.push_back(std::exchange(begun_, {}));
  return lines;
}

}  // namespace absenc::os
