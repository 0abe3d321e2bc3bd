// SPDX-License-Identifier: Apache-2.0
// What is wrong with a reply in words, and what the E201-9S document says to do about it.
#pragma once

#include <cstdint>

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/e201/frame.hpp"

namespace absenc::e201 {

/// `reply` to the command `letter`, which the checks of frame.hpp refuse with `error`, or nothing (timeout).
[[nodiscard]] Explanation explain(const Format& format, Error error, std::uint8_t letter, Bytes reply);

}  // namespace absenc::e201
