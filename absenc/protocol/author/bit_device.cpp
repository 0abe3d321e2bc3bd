// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/author/bit_device.hpp"

#include <algorithm>
#include <utility>

namespace absenc::author {

ByteStep BitDevice::next(Time) {
  if (!std::exchange(pending_, false)) return {.at = never};
  return {.kind = ByteStep::Kind::transfer, .out = bits_.bytes(), .bits = taken_};
}

void BitDevice::feed(const ByteEvent& event) {
  using Kind = ByteEvent::Kind;
  if (event.kind == Kind::selected) {
    pending_ = responded_ = false;
    taken_ = driven_from_ = 0;
    selected_ = is_on(event.at);
    if (selected_) selected(event.at, event.width);
  } else if (event.kind == Kind::received && selected_) {
    received(event);
  } else if (event.kind == Kind::sent && event.bits > 0 && std::exchange(selected_, false)) {
    clocked(event.at, event.bits);
  }
}

void BitDevice::received(const ByteEvent& event) {
  const BitView sent{event.items, std::min(event.bits, 8 * event.items.size())};
  if (responded_) {
    expect(event.clocks_before >= reply_end(), directions_->supplement, event.at);
    return supplemented(sent, event.at);
  }
  ReceivedBits request;
  const std::size_t size = std::min(request_size(sent), ReceivedBits::capacity());
  for (std::size_t i = 0; i < size; ++i) {
    static_cast<void>(request.append(i < sent.size && !sent[i] ? 0 : 1, 1));
  }
  expect(sent.size <= size, directions_->request, event.at);
  bits_.clear();
  driven_from_ = event.clocks_before + event.bits;
  respond(request.view(), event.at, bits_);
  if (taken_ == 0) taken_ = bits_.size();
  // Nobody drives the line behind the last bit, so it is high.
  while (bits_.size() % 8 != 0) static_cast<void>(bits_.append(1, 1));
  pending_ = responded_ = true;
}

void BitDevice::power_off(Time now) {
  EncoderOn::power_off(now);
  pending_ = selected_ = false;
}

}  // namespace absenc::author
