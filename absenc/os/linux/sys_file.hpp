// SPDX-License-Identifier: Apache-2.0
// Reading of one-line files in /sys and /proc.
#pragma once

#include <charconv>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

namespace absenc::os {

/// Returns the first line of the file at `path`; "" if the file cannot be read or is empty.
[[nodiscard]] inline std::string first_line(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

/// Returns the number of up to 32 bits with which the file at `path` begins; empty if it does not begin with a
/// number.
[[nodiscard]] inline std::optional<std::uint32_t> first_number(const std::filesystem::path& path, int base = 10) {
  const std::string text = first_line(path);
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (error != std::errc{}) return std::nullopt;
  return number;
}

}  // namespace absenc::os
