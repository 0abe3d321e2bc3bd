// SPDX-License-Identifier: Apache-2.0
// The options --rate, --command and --realtime of verbs that read repeatedly.
#pragma once

#include <string>
#include <vector>

#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// Returns the value of --rate in readings per second (0: as fast as possible), or `fallback` without this option.
/// Throws UsageError.
[[nodiscard]] double readings_a_second(const Invocation& invocation, double fallback);

/// Returns settings for the encoder's address: those of --option, "command=NAME" for --command, "realtime=PRIORITY" for
/// --realtime.
[[nodiscard]] std::vector<std::string> reading_settings(const Invocation& invocation);

}  // namespace absenc::tool
