// SPDX-License-Identifier: Apache-2.0
// Reading of standard input: a terminal, a pipe or a file.
#pragma once

#include <cstddef>
#include <optional>

#include "absenc/core/bytes.hpp"
#include "absenc/core/time.hpp"

namespace absenc::os {

/// Reads standard input as soon as bytes are available. Returns their number; 0 at the end, nothing at `deadline`.
/// Throws Failure, Interrupted, Ended.
[[nodiscard]] std::optional<std::size_t> read_standard_input(MutableBytes into, Time deadline);

}  // namespace absenc::os
