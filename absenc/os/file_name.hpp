// SPDX-License-Identifier: Apache-2.0
// Names of files, in UTF-8, as paths and back. On Windows the conversions of std::filesystem::path take plain
// characters in another encoding.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace absenc::os {

/// Returns the path that `name` means.
[[nodiscard]] inline std::filesystem::path path_of(std::string_view name) {
  return {std::u8string(name.begin(), name.end())};
}

/// Returns the name of `path`.
[[nodiscard]] inline std::string name_of(const std::filesystem::path& path) {
  const std::u8string name = path.u8string();
  return {name.begin(), name.end()};
}

}  // namespace absenc::os
