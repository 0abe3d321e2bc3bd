// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/text/output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "absenc/os/process.hpp"
#include "tools/absenc/error.hpp"

namespace absenc::tool {

void print_line(std::string_view text) {
  const int error = os::write_standard_output(text.ends_with('\n') ? std::string(text) : fmt::format("{}\n", text));
  if (error == 0) return;
  if (error == EPIPE) throw OutputClosed{};
  throw Failure(fmt::format("standard output cannot be written: {}", std::strerror(error)));
}

void print_note(std::string_view text) { print_prompt(fmt::format("{}\n", text)); }

void print_message(std::string_view text) { print_prompt(fmt::format("absenc: {}\n", text)); }

void print_prompt(std::string_view text) { os::write_standard_error(text); }

bool can_ask() { return os::is_terminal(0) && os::is_terminal(2); }

std::string table(std::span<const std::vector<std::string>> rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) line += fmt::format("{:<{}}", row[i], widths[i] + 2);
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + '\n';
  }
  return text;
}

}  // namespace absenc::tool
