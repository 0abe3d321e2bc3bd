// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/can/host.hpp"

#include <algorithm>

namespace absenc::raa38::can {

Read::Read(const Format& format, Mode mode) : format_(format) {
  if (mode == Mode::listen) {
    listen(listening_time);
  } else {
    ask(position_request(format, mode), Protocol::host_times(format));
  }
}

void Read::heard(const CanFrame& frame, Time at) {
  // A frame whose 29-bit identifier has the number of the reply's 11-bit identifier may come from another device. It is
  // no reply, but the host keeps it as evidence for the user.
  if (frame.extended && frame.id == encode_position(format_.node, 0).id) keep(frame, at);
  if (!is_from(frame, format_.node)) return;
  keep(frame, at);
  const Result<std::uint32_t> counts = decode_position(format_, frame);
  // The document does not state when the node latches the position. The end of the request is taken as this time, and
  // without a request the time at which the frame arrived.
  if (counts) {
    reading_ = {.singleturn = *counts,
                .singleturn_bits = format_.bits,
                .singleturn_valid_bits = format_.bits,
                .latched = exchange().sent.empty() ? at : sent_at(),
                .received = at};
  }
  finish({counts.error()});
}

void Read::over() {
  const Exchange<CanFrame> all = exchange();
  if (!all.received.empty() && !is_disturbed()) return finish({Error::unexpected_reply});
  if (!all.sent.empty() || is_disturbed()) return finish({missing()});
  finish(author::only(Error::timeout, "the node sends nothing by itself",
                      "let it: `absenc run ... cyclic 10`, or ask it: listen=false"));
}

unsigned Nodes::count() const {
  return static_cast<unsigned>(
      std::count_if(at.begin(), at.end(), [](const NodeFrames& node) { return node.is_there(); }));
}

// ---- Explanations

Explanation explain(const Format&, Error error, std::span<const CanFrame> request, std::span<const CanFrame> reply) {
  const bool asks = reply.empty();
  if (asks && request.empty()) return {};
  const CanFrame& frame = asks ? request[0] : reply[0];
  const Function function = function_of(frame);
  if (frame.remote) return {"it is a remote frame, and these encoders know none", {}};
  if (asks && error == Error::bad_framing) {
    return {"frames are destroyed on the bus",
            "check supply, CANH and CANL, 120 ohms at both ends, the bit rate, and that no two nodes have one number"};
  }
  if (asks && error == Error::timeout) {
    return {{},
            "check supply, CANH and CANL, 120 ohms at both ends, the bit rate and the node: `absenc scan` asks "
            "them all"};
  }
  if (asks && error == Error::unexpected_reply) {
    return {"nobody sends such a frame to this encoder: its identifiers are 2NN and 7E5",
            "what a node sends is a reply, not a request"};
  }
  switch (error) {
    case Error::cross_check_failed:
      return {"the identifier and the second byte name different nodes", {}};
    case Error::unsupported:
      return {"the first byte is none of the commands that the document has", {}};
    case Error::wrong_length:
      return {"every frame of this encoder has 8 bytes of data", {}};
    case Error::unexpected_reply:
      if (frame.extended) return {"its identifier has 29 bits, those of this encoder have 11", {}};
      if (function == Function::command) {
        return {"it is what a node is sent, not what it sends", "give it as the request"};
      }
      if (function == Function::unknown) return {"none of this encoder's frames has that identifier", {}};
      return {};
    case Error::out_of_range:
      if (function != Function::reply) return {};
      return {"the position has more bits than the encoder", "set bits=10 to 21"};
    case Error::request_rejected:
      return {"its second byte is an error code of CiA 305 (1: value not supported)", {}};
    default:
      return {};
  }
}

}  // namespace absenc::raa38::can
