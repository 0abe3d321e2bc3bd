// SPDX-License-Identifier: Apache-2.0
// What is wrong with a reply in words, and what the E201-9S document says to do about it.
#pragma once

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/e201/frame.hpp"

namespace absenc::e201 {

inline constexpr std::string_view check_stream = "check that it is an E201-9S and does not stream (stream-off)";

/// `reply` to `request`, which Protocol::decode refuses with `error`, or nothing (timeout).
[[nodiscard]] Explanation explain(const Format& format, Error error, Bytes request, Bytes reply);

}  // namespace absenc::e201
