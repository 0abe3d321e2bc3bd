// SPDX-License-Identifier: Apache-2.0
// Text functions for firmware that link neither memchr nor exceptions.
#pragma once

#include <cstddef>
#include <string_view>

namespace absenc {

/// Returns the index of the first `c` in `text`, or the size of `text` if it has none.
[[nodiscard]] constexpr std::size_t index_of(std::string_view text, char c) {
  std::size_t index = 0;
  while (index < text.size() && text[index] != c) ++index;
  return index;
}

/// Returns the first `count` characters of `text`, or all of `text` if it is shorter.
[[nodiscard]] constexpr std::string_view first_of(std::string_view text, std::size_t count) {
  return {text.data(), count < text.size() ? count : text.size()};
}

/// Returns `text` without its first `count` characters; empty if it is shorter.
[[nodiscard]] constexpr std::string_view behind(std::string_view text, std::size_t count) {
  text.remove_prefix(count < text.size() ? count : text.size());
  return text;
}

}  // namespace absenc
