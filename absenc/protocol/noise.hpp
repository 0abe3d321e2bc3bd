// SPDX-License-Identifier: Apache-2.0
// A line that is never silent, which is another fault than received noise.
#pragma once

#include "absenc/core/time.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc {

using namespace std::chrono_literals;

/// Traffic of this duration makes a line count as never silent: long enough for a reply that a carrier delivers in
/// pieces. Slow characters need more.
inline constexpr Time noise_limit = 100ms;

/// Explanation of such a line.
inline constexpr Explanation endless_noise{"something sends without a pause", "find the node that does not stop"};

}  // namespace absenc
