// SPDX-License-Identifier: Apache-2.0
// What ends a subcommand from deep inside. main.cpp prints it and chooses the exit status.
#pragma once

#include <stdexcept>

namespace absenc::tool {

inline constexpr int exit_good = 0;
inline constexpr int exit_failed = 1;  // the encoder, the line or the system
inline constexpr int exit_usage = 2;

/// The user asked for something that cannot be: a sentence that names what and where.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The system refused something that is no port: a sentence.
struct ToolFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Nobody reads standard output any more, as after `| head`.
struct OutputClosed {};

}  // namespace absenc::tool
