// SPDX-License-Identifier: Apache-2.0
// Reading of standard input: a terminal, a pipe or a file.
#pragma once

#include <cstddef>
#include <optional>

#include "absenc/core/bytes.hpp"
#include "absenc/core/time.hpp"

namespace absenc::os {

/// Reads bytes that are there already, like read(2) from a descriptor that does not block: returns their number, 0 at
/// the end of the input, -1 with errno, which is EAGAIN if no byte is there.
[[nodiscard]] std::ptrdiff_t read_what_is_there(int descriptor, MutableBytes into);

/// Makes reading a terminal from its background fail with EIO, where that would otherwise stop the program.
void allow_background(int descriptor);

/// Waits for bytes on standard input and reads them. Returns their number: 0 at the end of the input; nothing if no
/// byte is available until `deadline`. Throws Failure, Interrupted, Ended.
[[nodiscard]] std::optional<std::size_t> read_standard_input(MutableBytes into, Time deadline);

}  // namespace absenc::os
