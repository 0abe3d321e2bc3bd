// SPDX-License-Identifier: Apache-2.0
// Writes data to standard output and messages to standard error.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/time.hpp"

namespace absenc::tool {

/// Writes `text` to standard output, with a line end. Throws OutputClosed, Failure.
void print_line(std::string_view text);

/// Writes "absenc: <text>" and a line end to standard error.
void print_message(std::string_view text);
/// Writes `text` and a line end to standard error.
void print_note(std::string_view text);
/// Writes `text` without a line end to standard error.
void print_prompt(std::string_view text);

/// Returns whether standard input and standard error are terminals.
[[nodiscard]] bool can_ask();

/// Returns rows of cells as lines of text with aligned columns, without trailing spaces.
[[nodiscard]] std::string table(std::span<const std::vector<std::string>> rows);

}  // namespace absenc::tool
