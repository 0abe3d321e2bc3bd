// SPDX-License-Identifier: Apache-2.0
// Runs the server: in the program absenc-serve, or in the command itself where that is one file.
#pragma once

#include <span>

namespace absenc::tool {

/// Runs a command line, `words`, that begins with the verb `serve`, and returns the exit status. Throws UsageError,
/// Failure.
[[nodiscard]] int run_server(std::span<char* const> words);

}  // namespace absenc::tool
