// SPDX-License-Identifier: Apache-2.0
// The options --rate and --command of verbs that read repeatedly.
#pragma once

#include <string>
#include <vector>

#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// Returns the value of --rate in readings per second, `fallback` without the option; 0 means as fast as possible.
/// Prints a note if --for ends before the second reading. Throws UsageError, also for a rate so low that the second
/// reading would come after decades.
[[nodiscard]] double readings_a_second(const Invocation& invocation, double fallback);

/// Returns the settings that the user gave with --option and, if given, the one of --command.
[[nodiscard]] std::vector<std::string> reading_settings(const Invocation& invocation);

}  // namespace absenc::tool
