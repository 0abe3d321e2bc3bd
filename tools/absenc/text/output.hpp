// SPDX-License-Identifier: Apache-2.0
// Data goes to standard output, messages to standard error; what cannot be written is noticed at once.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/time.hpp"

namespace absenc::tool {

/// Writes `text`, with one line end behind it, to standard output at once. Throws OutputClosed, Failure.
void print_line(std::string_view text);

/// Writes "absenc: <text>" to standard error.
void print_message(std::string_view text);
/// Writes `text` and a line end to standard error.
void print_note(std::string_view text);
/// Writes `text` to standard error and leaves the cursor behind it.
void print_prompt(std::string_view text);

/// Whether somebody sits in front of standard input and standard error.
[[nodiscard]] bool can_ask();

/// Rows in aligned columns, each line with its end. No trailing spaces.
[[nodiscard]] std::string table(std::span<const std::vector<std::string>> rows);

}  // namespace absenc::tool
