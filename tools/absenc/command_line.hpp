// SPDX-License-Identifier: Apache-2.0
// The parts of a command line that all programs of the command share.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// Returns whether the word is --help or -h.
[[nodiscard]] bool asks_for_help(std::string_view word);

/// Returns the parameters in the words after a verb; nothing if help was requested. Throws UsageError.
[[nodiscard]] std::optional<Invocation> parse_arguments(const Subcommand& subcommand, std::span<char* const> words);

/// Runs `work` and returns its exit status; prints the text of an exception. `understood` is the part of the verb that
/// was recognised when `work` ended.
[[nodiscard]] int run_guarded(const std::function<int()>& work, const std::string& understood);

}  // namespace absenc::tool
