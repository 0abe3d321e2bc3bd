// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/author/clocked_device.hpp"

#include <utility>

namespace absenc::author {

ByteStep ClockedDevice::next(Time) {
  if (!std::exchange(pending_, false)) return {.at = never};
  return {.kind = ByteStep::Kind::transfer, .out = bits_.bytes(), .bits = taken_, .width = low_after_};
}

void ClockedDevice::feed(const ByteEvent& event) {
  if (event.kind == ByteEvent::Kind::selected && is_on(event.at)) {
    bits_.clear();
    low_after_ = {};
    taken_ = 0;
    selected(event.at, event.width, event.held_low, bits_);
    pending_ = driving_ = true;
  } else if (event.kind == ByteEvent::Kind::sent && event.bits > 0 && std::exchange(driving_, false)) {
    clocked(event.at, event.bits);
  }
}

void ClockedDevice::power_off(Time now) {
  EncoderOn::power_off(now);
  pending_ = driving_ = false;
}

}  // namespace absenc::author
