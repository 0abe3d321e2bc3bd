// SPDX-License-Identifier: Apache-2.0
// Exit statuses of the command `absenc`, and the exception for a closed output.
#pragma once

#include "absenc/client/error.hpp"

namespace absenc::tool {

using namespace client;  // the command uses the names of namespace client without a prefix

inline constexpr int exit_good = 0;
inline constexpr int exit_failed = 1;  // exit status of a failure, for example of the encoder, the line or the system
inline constexpr int exit_usage = 2;
// exit status of a test without a verdict, because too little was observed
inline constexpr int exit_nothing_judged = 3;

/// Exception thrown when standard output is closed, as after `| head`.
struct OutputClosed {};

}  // namespace absenc::tool
