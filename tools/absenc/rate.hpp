// SPDX-License-Identifier: Apache-2.0
// --rate of whoever reads again and again.
#pragma once

#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// Readings a second; 0: as fast as can be. Notes when --for ends before the second reading. Throws UsageError, also
/// for a rate at which hardly anybody would live to see that.
[[nodiscard]] double readings_a_second(const Invocation& invocation, double fallback);

}  // namespace absenc::tool
