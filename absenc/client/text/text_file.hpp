// SPDX-License-Identifier: Apache-2.0
// Reads text files and their lines, and checks paths before files are written.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace absenc::client {

// First line of a file with the memory of a virtual encoder; the line names the kind of the file.
inline constexpr std::string_view memory_file_title = "absenc memory 1";
// First line of a dump, which is a copy of the memory of an encoder.
inline constexpr std::string_view dump_title = "absenc dump 1";

/// Returns the content of a file of at most about 16 MiB; `what` says in errors what the file is. Throws Failure.
[[nodiscard]] std::string read_text_file(std::string_view what, const std::string& path);

/// Returns the absolute path to which `path` leads through up to 40 symbolic links.
[[nodiscard]] std::string link_target(const std::string& path);

/// Throws Failure if the path is known not to be writable.
void require_replaceable(const std::string& path);

/// Iterates over lines that are neither empty nor begin with #.
class SignificantLines {
 public:
  explicit SignificantLines(std::string_view text) : rest_(text) {}

  bool next();

  std::string_view line;
  std::size_t number = 0;  // number of `line` in the text, from 1; ignored lines are counted

 private:
  std::string_view rest_;
};

}  // namespace absenc::client
