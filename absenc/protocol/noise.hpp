// SPDX-License-Identifier: Apache-2.0
// Limit and explanation for a line that is never silent.
#pragma once

#include "absenc/core/time.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc {

using namespace std::chrono_literals;

/// Usual time without silence after which a line counts as never silent.
inline constexpr Time noise_limit = 100ms;

/// Texts that explain the error of a conversation on a line that is never silent.
inline constexpr Explanation endless_noise{"something sends without a pause", "find the node that does not stop"};

}  // namespace absenc
