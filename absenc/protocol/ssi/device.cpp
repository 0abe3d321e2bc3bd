// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/ssi/device.hpp"

#include <algorithm>

namespace absenc::ssi {

namespace {
using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;
}  // namespace

ByteStep VirtualEncoder::next(Time) {
  if (!driving_) return {.at = never};
  driving_ = false;
  return {.kind = ByteStep::Kind::transfer, .out = bits_.bytes()};
}

void VirtualEncoder::feed(const ByteEvent& event) {
  if (event.kind == ByteEvent::Kind::selected) {
    if (powered_) selected(event.at, event.width);
  } else if (event.kind == ByteEvent::Kind::sent && event.bits > 0 && answering_) {
    answering_ = false;
    shifted_ += event.bits;
    if (shifted_ < format_.word.bits()) violate("fewer clocks than the word has bits", event.at);
    free_at_ = event.at + timing_.pause;
    ++answered_;
  }
}

void VirtualEncoder::selected(Time at, Time period) {
  if (period > Time{} && (period < timing_.shortest_period || period > timing_.longest_period)) {
    violate("clock outside min_clock_khz to max_clock_khz", at);
  }
  if (at < free_at_) {  // the shift register goes on
    violate("clocked again within pause_us", at);
    shifted_ %= 2 * format_.word.bits();
  } else {
    latched_ = word(at);
    shifted_ = 0;
  }
  bits_.clear();
  BitBuffer<WordFormat::maximum_bits> coded;
  encode_word(format_.word, latched_, coded);
  const std::size_t wanted = std::max(2 * format_.word.bits(), clocks(format_));
  const std::size_t count = std::min(bits_.capacity(), (wanted + 7) / 8 * 8);
  for (std::size_t i = 0; i < count; ++i) bits_.append(bit_behind(format_, coded.view(), shifted_ + i) ? 1 : 0, 1);
  driving_ = answering_ = true;
}

void VirtualEncoder::violate(std::string_view rule, Time at) {
  violations_.push_back({rule, at});
  ++violation_count_;
}

}  // namespace absenc::ssi
