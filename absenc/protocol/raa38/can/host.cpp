// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/can/protocol.hpp"

namespace absenc::raa38::can {

Read::Read(const Format& format, Way way) : CanEngine(Protocol::wire(format)), format_(format), way_(way) {
  if (way == Way::listen) {
    listen(listening_time);
  } else {
    ask(position_request(format, way));
  }
}

void Read::heard(const CanFrame& frame, Time at) {
  // Another device may use that identifier; but when nothing else comes it is what the user looks for.
  if (frame.extended && frame.id == encode_position(format_.node, 0).id) {
    keep(frame, at);
    only_extended_ = true;
  }
  if (!is_from(frame, format_.node)) return;
  keep(frame, at);
  const Result<std::uint32_t> counts = decode_position(format_, frame);
  // Nothing tells when the node took the position: after it was asked, or some time before it sent it by itself.
  reading_ = {.singleturn = *counts,
              .singleturn_bits = format_.bits,
              .singleturn_valid_bits = format_.bits,
              .latched = way_ == Way::ask ? sent_at() : at,
              .received = at};
  finish({counts.error()});
}

void Read::over() {
  if (only_extended_ && !is_disturbed()) return finish({Error::unexpected_reply});
  if (way_ != Way::listen || is_disturbed()) return finish({missing()});
  finish(author::only(Error::timeout, "the node sends nothing by itself",
                      "let it: `run <encoder> cyclic 10`, or ask it: listen=false"));
}

}  // namespace absenc::raa38::can
