// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/input_lines.hpp"

#include <array>
#include <cerrno>
#include <cstdint>
#include <utility>

#include "absenc/os/input.hpp"

namespace absenc::os {

namespace {
constexpr std::size_t longest_line = 4096;
}

InputLines::InputLines(int descriptor) : descriptor_(descriptor) { allow_background(descriptor); }

std::vector<std::string> InputLines::take() {
  std::vector<std::string> lines;
  if (ended_) return lines;
  std::array<std::uint8_t, longest_line> read{};
  const std::ptrdiff_t size = read_what_is_there(descriptor_, read);
  if (size < 0 && (errno == EIO || errno == EAGAIN || errno == EINTR)) return lines;
  ended_ = size <= 0;
  for (std::ptrdiff_t i = 0; i < size; ++i) {
    const char c = static_cast<char>(read[static_cast<std::size_t>(i)]);
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
