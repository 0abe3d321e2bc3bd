// SPDX-License-Identifier: Apache-2.0
// A line that is never silent, which is another fault than one on which something came.
#pragma once

#include "absenc/core/time.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc {

using namespace std::chrono_literals;

/// How long something may go on before the line counts as one that is never silent: long enough for a reply that a
/// carrier breaks into pieces. Slow characters want more.
inline constexpr Time noise_limit = 100ms;

/// What to say about such a line.
inline constexpr Explanation endless_noise{"something sends without a pause", "find the node that does not stop"};

}  // namespace absenc
