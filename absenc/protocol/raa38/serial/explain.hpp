// SPDX-License-Identifier: Apache-2.0
// What bad frames of an RAA38S6 on an asynchronous line turn out to be, in words.
#pragma once

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/raa38/serial/frame.hpp"

namespace absenc::raa38::serial {

/// About a reply to `request`, which may be empty, as to a pulse; with an empty reply about the request, or why none
/// came.
[[nodiscard]] Explanation explain(const Format& format, Error error, Bytes request, Bytes reply);

/// Why a stream has no good frame: timeout, bad_framing, out_of_range.
[[nodiscard]] Explanation explain_stream(Error error);

}  // namespace absenc::raa38::serial
