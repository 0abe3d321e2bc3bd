// SPDX-License-Identifier: Apache-2.0
// Text files that people read and edit: lines of "name: value" and bytes; what begins with # does not count.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace absenc::client {

// The first line says what a file is.
inline constexpr std::string_view memory_file_title = "absenc memory 1";  // of a virtual encoder
inline constexpr std::string_view dump_title = "absenc dump 1";           // copied from an encoder

/// Throws Failure, which begins with `what` and the path; also for what is larger than any such file (16 MiB).
[[nodiscard]] std::string read_text_file(std::string_view what, const std::string& path);

/// The file that a chain of symbolic links leads to, whether it is there or not: what is to be replaced.
[[nodiscard]] std::string link_target(const std::string& path);

/// For before work is done for nothing. Throws Failure when a file cannot be put there, or in the place of what is
/// there; only a regular file is ever replaced.
void require_replaceable(const std::string& path);

/// Hands out the lines that count, without blanks at their end.
class LineReader {
 public:
  explicit LineReader(std::string_view text) : rest_(text) {}

  bool next();

  std::string_view line;
  std::size_t number = 0;  // of `line`, from 1

 private:
  std::string_view rest_;
};

}  // namespace absenc::client
