// SPDX-License-Identifier: Apache-2.0
// What everybody who reads again and again is told: --rate, --command.
#pragma once

#include <string>
#include <vector>

#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// Readings a second; 0: as fast as can be. Notes when --for ends before the second reading. Throws UsageError, also
/// for a rate at which hardly anybody would live to see that.
[[nodiscard]] double readings_a_second(const Invocation& invocation, double fallback);

/// The settings of --option, with that of --command.
[[nodiscard]] std::vector<std::string> reading_settings(const Invocation& invocation);

}  // namespace absenc::tool
