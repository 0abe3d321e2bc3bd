// SPDX-License-Identifier: Apache-2.0
// Reads text files and their lines, and checks paths before files are written.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace absenc::client {

// First lines of files, which name the kind of file:
inline constexpr std::string_view memory_file_title = "absenc memory 1";  // memory of a virtual encoder
inline constexpr std::string_view dump_title = "absenc dump 1";           // dump: copy of the memory of an encoder

/// Returns the content of a file. Throws Failure, whose text begins with `what` and the path, if the file cannot be
/// read or has more than about 16 MiB.
[[nodiscard]] std::string read_text_file(std::string_view what, const std::string& path);

/// Returns the path at the end of a chain of up to 40 symbolic links, even if that file does not exist.
[[nodiscard]] std::string link_target(const std::string& path);

/// Checks, before long work, that the path is that of a regular file that can be replaced, or of no file in an existing
/// folder. Throws Failure if not.
void require_replaceable(const std::string& path);

/// Iterates over the lines of a text that are neither empty nor begin with #, and removes blanks at the end of each
/// line.
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
