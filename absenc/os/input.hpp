// SPDX-License-Identifier: Apache-2.0
// Reading of standard input: a terminal, a pipe or a file.
#pragma once

#include <cstddef>
#include <optional>

#include "absenc/core/bytes.hpp"
#include "absenc/core/time.hpp"

namespace absenc::os {

/// Waits for bytes on standard input and reads them. Returns their number: 0 at the end of the input; nothing if no
/// byte is available until `deadline`. Throws Failure, Interrupted, Ended.
[[nodiscard]] std::optional<std::size_t> read_standard_input(MutableBytes into, Time deadline);

}  // namespace absenc::os
