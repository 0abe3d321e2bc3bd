// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/faulty_node.hpp"

#include <algorithm>

namespace absenc::sim {

FaultyNode::FaultyNode(Machine<CanFrame>& device, const FaultRates& rates, std::uint64_t seed)
    : device_(device), rates_(rates), random_(seed) {}

bool FaultyNode::strikes(FaultKind kind) {
  if (!random_.chance(rates_[kind])) return false;
  ++counts_[static_cast<std::size_t>(kind)];
  return true;
}

void FaultyNode::feed(const Event<CanFrame>& event) {
  if (event.kind != Event<CanFrame>::Kind::received || event.items.empty()) return device_.feed(event);
  last_received_ = event.items.back();
  has_received_ = true;
  std::vector<CanFrame> damaged(event.items.begin(), event.items.end());
  for (CanFrame& frame : damaged) {
    if (frame.size > 0 && strikes(FaultKind::request_corrupt))
      flip_bits(std::span(frame.data).first(frame.size), random_);
  }
  Event<CanFrame> changed = event;
  changed.items = damaged;
  device_.feed(changed);
}

Step<CanFrame> FaultyNode::next(Time now) {
  using Kind = Step<CanFrame>::Kind;
  for (;;) {
    Step<CanFrame> step = device_.next(now);
    if (step.kind != Kind::transfer) return step;
    const auto before = counts_;
    out_.clear();
    for (const CanFrame& frame : step.out) damage(frame);
    if (!out_.empty() && strikes(FaultKind::delay)) step.at = std::max(step.at, now) + rates_.delay;
    if (counts_ != before) ++damaged_;
    step.out = out_;
    if (!out_.empty()) return step;
    device_.feed({.kind = Event<CanFrame>::Kind::sent, .at = now});
  }
}

void FaultyNode::damage(const CanFrame& frame) {
  if (strikes(FaultKind::silence)) return;
  CanFrame sent = frame;
  if (sent.size > 0 && strikes(FaultKind::corrupt)) flip_bits(std::span(sent.data).first(sent.size), random_);
  if (sent.size > 0 && strikes(FaultKind::drop)) --sent.size;
  if (sent.size > 0 && strikes(FaultKind::truncate)) sent.size = static_cast<std::uint8_t>(random_.below(sent.size));
  std::fill(sent.data.begin() + sent.size, sent.data.end(), std::uint8_t{0});
  if (strikes(FaultKind::garbage)) {
    CanFrame garbage{.id = static_cast<std::uint32_t>(random_.below(0x800)), .size = 8};
    for (std::uint8_t& byte : garbage.data) byte = static_cast<std::uint8_t>(random_.below(256));
    out_.push_back(garbage);
  }
  if (has_received_ && strikes(FaultKind::echo)) out_.push_back(last_received_);
  out_.push_back(sent);
  if (strikes(FaultKind::repeat)) out_.push_back(sent);
}

}  // namespace absenc::sim
