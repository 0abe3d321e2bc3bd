// SPDX-License-Identifier: Apache-2.0
// How the command ends.
#pragma once

#include "absenc/client/error.hpp"

namespace absenc::tool {

using namespace client;  // the command is written in the words of the library

inline constexpr int exit_good = 0;
inline constexpr int exit_failed = 1;  // the encoder, the line or the system
inline constexpr int exit_usage = 2;
inline constexpr int exit_nothing_judged = 3;  // nothing was seen of which a verdict could be given

/// Nobody reads standard output any more, as after `| head`.
struct OutputClosed {};

}  // namespace absenc::tool
