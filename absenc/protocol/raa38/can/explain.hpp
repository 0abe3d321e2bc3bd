// SPDX-License-Identifier: Apache-2.0
// What frames on CAN that are no answers turn out to be, in words.
#pragma once

#include "absenc/link/can.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::raa38::can {

/// What a frame with such an error shows, and what to do. Either may be null.
[[nodiscard]] Explanation explain_frame(Error error, const CanFrame* request, const CanFrame* reply);

}  // namespace absenc::raa38::can
