// SPDX-License-Identifier: Apache-2.0
// Why an encoder refused a request, as its reply tells: the communication alarms of SF (6.3.2), or what else is
// answered like data ID 3 (8.4, 9.4).
#pragma once

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/tformat/frame.hpp"

namespace absenc::tformat {

/// Of a reply that is refused with request_rejected.
[[nodiscard]] constexpr Explanation explain_refusal(Bytes reply) {
  constexpr std::string_view again =
      "send the same request again, and use nothing of what came (6.3.2); if it stays, check baud rate, termination "
      "and "
      "shielding";
  const int alarm = reply.size() > 1 ? reply[1] & status::rejected : 0;
  if (alarm == status::rejected) {
    return {
        "ca0 and ca1: it received the request with a parity error of the data ID, and with a damaged character (a "
        "wrong delimiter)",
        again};
  }
  if (alarm == status::parity_error) {
    return {"ca0: it received the request with a parity error of the data ID", again};
  }
  if (alarm == status::delimiter_error) {
    return {"ca1: it received a damaged character of the request (a wrong delimiter)", again};
  }
  return {
      "it answered as to data ID 3, without a communication alarm: a data ID that it does not have, a CRC that is "
      "wrong, or an address that is closed"};
}

}  // namespace absenc::tformat
