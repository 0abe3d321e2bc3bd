// SPDX-License-Identifier: Apache-2.0
// Bytes of standard input: of a terminal, a pipe or a file.
#pragma once

#include <cstddef>
#include <optional>

#include "absenc/core/bytes.hpp"
#include "absenc/core/time.hpp"

namespace absenc::os {

/// Returns how many bytes came, as soon as there are some; 0 at the end of the input; nothing when `deadline` (`never`:
/// none) came first. Throws Failure, Interrupted, Ended.
[[nodiscard]] std::optional<std::size_t> read_standard_input(MutableBytes into, Time deadline);

}  // namespace absenc::os
