// SPDX-License-Identifier: Apache-2.0
// What a reply over Modbus RTU that was refused turns out to be, in words.
#pragma once

#include "absenc/protocol/raa38/modbus/frame.hpp"

namespace absenc::raa38::rtu {

/// About a reply to `request` that decode_reply refuses with `error`; an empty one: nothing came.
[[nodiscard]] Explanation explain(const Request& request, Error error, Bytes reply);

/// About a request that decode_request refuses with `error`.
[[nodiscard]] Explanation explain_request(Error error, Bytes request);

}  // namespace absenc::raa38::rtu
