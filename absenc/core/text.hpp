// SPDX-License-Identifier: Apache-2.0
// Cutting text where std::string_view would want memchr and an exception, which firmware does not have.
#pragma once

#include <cstddef>
#include <string_view>

namespace absenc {

/// The index of the first `c`, or the size of the text.
[[nodiscard]] constexpr std::size_t index_of(std::string_view text, char c) {
  std::size_t index = 0;
  while (index < text.size() && text[index] != c) ++index;
  return index;
}

/// The first `count` characters, or all when there are fewer.
[[nodiscard]] constexpr std::string_view first_of(std::string_view text, std::size_t count) {
  return {text.data(), count < text.size() ? count : text.size()};
}

/// What is behind the first `count` characters.
[[nodiscard]] constexpr std::string_view behind(std::string_view text, std::size_t count) {
  text.remove_prefix(count < text.size() ? count : text.size());
  return text;
}

}  // namespace absenc
