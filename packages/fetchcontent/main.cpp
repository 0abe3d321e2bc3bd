// SPDX-License-Identifier: Apache-2.0
// Runs a conversation without a line: the reply of a Smart-Abs encoder at 74565 of 2^17 counts and 4660 turns is a
// constant.
#include <array>
#include <cstdint>

#include "absenc/protocol/tformat/host.hpp"

int main() {
  using namespace absenc;
  static constexpr auto reply =
      std::to_array<std::uint8_t>({0x1A, 0x00, 0x45, 0x23, 0x01, 0x11, 0x34, 0x12, 0x00, 0x00, 0x4A});
  tformat::ReadPosition read{tformat::Format{.singleturn_bits = 17, .multiturn_bits = 16, .encoder_id = 0x11}};
  Time now{};
  for (ByteStep step = read.next(now); step.kind != ByteStep::Kind::done; step = read.next(now)) {
    now += std::chrono::microseconds(50);
    if (step.kind == ByteStep::Kind::transfer) {
      read.feed({.kind = ByteEvent::Kind::sent, .at = now});  // tells the conversation that its request was sent
    } else {
      read.feed({.kind = ByteEvent::Kind::received, .at = now, .items = reply});
    }
  }
  const Reading* const reading = read.reading();
  const bool good = reading != nullptr && reading->singleturn_valid() && reading->multiturn_valid;
  return good && reading->singleturn == 74565 && reading->multiturn == 4660 ? 0 : 1;
}
