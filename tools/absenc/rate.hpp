// SPDX-License-Identifier: Apache-2.0
// The options --rate and --command of verbs that read repeatedly.
#pragma once

#include <string>
#include <vector>

#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// Returns the value of --rate in readings per second, `fallback` without the option; 0 means as fast as possible.
/// Prints a note if --for ends before the second reading. Throws UsageError if the value is no number from 0 to 1 000
/// 000, or is above 0 but below one reading per day.
[[nodiscard]] double readings_a_second(const Invocation& invocation, double fallback);

/// Returns the settings that the user gave with --option, and "command=NAME" if the option --command was given.
[[nodiscard]] std::vector<std::string> reading_settings(const Invocation& invocation);

}  // namespace absenc::tool
