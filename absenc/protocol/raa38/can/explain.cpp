// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/can/explain.hpp"

#include "absenc/protocol/raa38/can/frame.hpp"

namespace absenc::raa38::can {

namespace {
constexpr std::string_view check_bus =
    "check supply, CANH and CANL, 120 ohms at both ends, the bit rate, and that no two nodes have one number";
}  // namespace

Explanation explain_frame(Error error, const CanFrame* request, const CanFrame* reply) {
  if (reply == nullptr && request != nullptr) {
    switch (error) {
      case Error::bad_framing:
        if (request->remote) break;
        return {"frames are destroyed on the bus", check_bus};
      case Error::timeout:
        return {{},
                "check supply, CANH and CANL, 120 ohms at both ends, the bit rate and the node: `scan` asks them all"};
      case Error::cross_check_failed:
        return {"the identifier and the second byte name different nodes", {}};
      case Error::unsupported:
        return {"the first byte is none of the commands that the document has", {}};
      case Error::unexpected_reply:
        return {"nobody sends such a frame to this encoder: its identifiers are 2NN and 7E5",
                "what a node sends is a reply, not a request"};
      default:
        break;
    }
  }
  const CanFrame* frame = reply != nullptr ? reply : request;
  if (frame == nullptr) return {};
  if (frame->remote) return {"it is a remote frame, and these encoders know none", {}};
  switch (error) {
    case Error::wrong_length:
      return {"every frame of this encoder has 8 bytes of data", {}};
    case Error::unexpected_reply:
      if (frame->extended) return {"its identifier has 29 bits, those of this encoder have 11", {}};
      if (function_of(*frame) == Function::command) {
        return {"it is what a node is sent, not what it sends", "give it as the request"};
      }
      if (function_of(*frame) == Function::unknown) return {"none of this encoder's frames has that identifier", {}};
      return {};
    case Error::out_of_range:
      if (function_of(*frame) == Function::reply)
        return {"the position has more bits than the encoder", "set bits=10 to 21"};
      return {};
    case Error::request_rejected:
      return {"its second byte is an error code of CiA 305 (1: value not supported)", {}};
    default:
      return {};
  }
}

}  // namespace absenc::raa38::can
