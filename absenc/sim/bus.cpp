// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/bus.hpp"

#include <algorithm>
#include <stdexcept>

namespace absenc::sim {

namespace {

// The transfer of a device is given to the port at most this time before it begins, because until its end no other
// device can begin a transfer.
constexpr Time soon = std::chrono::milliseconds(1);

// Returns the shorter of two limits; 0 means no limit.
Time shorter(Time one, Time other) {
  if (one == Time{} || other == Time{}) return std::max(one, other);
  return std::min(one, other);
}

}  // namespace

Bus::Bus(const std::vector<Machine<std::uint8_t>*>& devices, Time character) : character_(character) {
  for (Machine<std::uint8_t>* device : devices) nodes_.push_back({.device = device});
}

void Bus::feed(const ByteEvent& event) {
  if (event.kind == ByteEvent::Kind::sent) return report_sent(event);
  for (Node& node : nodes_) {
    if (node.send_state == SendState::done) continue;
    if (event.kind == ByteEvent::Kind::timer) {
      if (event.at < node.timer) continue;
      node.timer = never;
    }
    if (event.kind == ByteEvent::Kind::silence && node.send_state != SendState::waiting) continue;
    node.device->feed(event);
    serve(node, event.at);
  }
}

void Bus::report_sent(const ByteEvent& event) {
  sending_ = false;
  for (Node& node : nodes_) {
    if (node.send_state == SendState::done) continue;
    if (node.send_state == SendState::sending) {
      node.send_state = SendState::waiting;
      node.device->feed(event);
    } else {
      node.device->feed({.kind = ByteEvent::Kind::received, .at = event.at, .items = out_});
      serve(node, event.at);
      if (node.send_state == SendState::waiting) node.device->feed({.kind = ByteEvent::Kind::silence, .at = event.at});
    }
    serve(node, event.at);
  }
}

void Bus::serve(Node& node, Time now) {
  while (node.send_state != SendState::done) {
    const ByteStep step = node.device->next(now);
    switch (step.kind) {
      case ByteStep::Kind::wait:
        node.wait = step;
        node.timer = step.at > now ? step.at : never;
        return;
      case ByteStep::Kind::transfer:
        if (node.send_state != SendState::waiting)
          throw std::logic_error("a device began a transfer before its last one was sent");
        node.send_state = SendState::pending;
        node.at = std::max(step.at, now);
        node.out.assign(step.out.begin(), step.out.end());
        break;
      case ByteStep::Kind::done:
        node.send_state = SendState::done;
        return;
      case ByteStep::Kind::emit:
      case ByteStep::Kind::pulse:
      case ByteStep::Kind::configure:
        break;
    }
  }
}

ByteStep Bus::next(Time now) {
  for (Node& node : nodes_) serve(node, now);
  if (!sending_ && first_begin() <= now + soon) {
    const Time at = first_begin();
    merge();
    return {.kind = ByteStep::Kind::transfer, .out = out_, .at = at};
  }
  return wait_step();
}

Time Bus::first_begin() const {
  Time first = never - soon;  // a time in the far future, to which a caller may add `soon` without overflow
  for (const Node& node : nodes_) {
    if (node.send_state == SendState::pending) first = std::min(first, node.at);
  }
  return first;
}

// Combines the transfer that begins first with all pending transfers that overlap it into one.
void Bus::merge() {
  std::vector<Node*> pending;
  for (Node& node : nodes_) {
    if (node.send_state == SendState::pending) pending.push_back(&node);
  }
  std::stable_sort(pending.begin(), pending.end(),
                   [](const Node* one, const Node* other) { return one->at < other->at; });
  out_.clear();
  for (Node* node : pending) {
    const auto offset = static_cast<std::size_t>((node->at - pending.front()->at + character_ / 2) / character_);
    if (node != pending.front() && offset >= out_.size()) break;
    out_.resize(std::max(out_.size(), offset + node->out.size()), 0xFF);
    for (std::size_t i = 0; i < node->out.size(); ++i) out_[offset + i] &= node->out[i];
    node->send_state = SendState::sending;
  }
  sending_ = true;
}

ByteStep Bus::wait_step() const {
  ByteStep step{.at = never};
  for (const Node& node : nodes_) {
    if (node.send_state == SendState::done) continue;
    step.at = std::min(step.at, node.timer);
    if (node.send_state == SendState::pending && !sending_) step.at = std::min(step.at, node.at);
    if (node.send_state != SendState::waiting) continue;
    step.answer = shorter(step.answer, node.wait.answer);
    step.gap = shorter(step.gap, node.wait.gap);
    if (node.wait.gap > Time{}) step.expect = std::max(step.expect, node.wait.expect);
  }
  return step;
}

}  // namespace absenc::sim
