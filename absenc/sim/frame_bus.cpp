// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/frame_bus.hpp"

#include <algorithm>
#include <stdexcept>
#include <tuple>
#include <utility>

namespace absenc::sim {

using FrameStep = Step<CanFrame>;
using FrameEvent = Event<CanFrame>;

FrameBus::FrameBus(const std::vector<Machine<CanFrame>*>& nodes, std::uint32_t rate) : rate_(rate) {
  for (Machine<CanFrame>* node : nodes) nodes_.push_back({node, rate});
}

void FrameBus::feed(const FrameEvent& event) {
  if (event.kind == FrameEvent::Kind::sent) return report_sent(event.at);
  for (Node& node : nodes_) {
    if (node.send_state == SendState::done) continue;
    const bool from_bus = event.kind == FrameEvent::Kind::received || event.kind == FrameEvent::Kind::line_error;
    if (from_bus && node.rate != rate_) continue;
    if (event.kind == FrameEvent::Kind::timer) {
      if (event.at < node.timer) continue;
      node.timer = never;
    }
    node.machine->feed(event);
    serve(node, event.at);
  }
}

void FrameBus::report_sent(Time at) {
  Node* const sender = std::exchange(sender_, nullptr);
  if (sender == nullptr) return;
  for (Node& node : nodes_) {
    if (&node == sender || node.send_state == SendState::done || node.rate != rate_) continue;
    node.machine->feed({.kind = FrameEvent::Kind::received, .at = at, .items = {&out_, 1}});
    serve(node, at);
  }
  sender->out.pop_front();
  if (!sender->out.empty()) {
    sender->send_state = SendState::pending;
    return;
  }
  sender->send_state = SendState::waiting;
  sender->machine->feed({.kind = FrameEvent::Kind::sent, .at = at});
  serve(*sender, at);
}

void FrameBus::serve(Node& node, Time now) {
  while (node.send_state != SendState::done) {
    const FrameStep step = node.machine->next(now);
    switch (step.kind) {
      case FrameStep::Kind::wait:
        node.timer = step.at > now ? step.at : never;
        return;
      case FrameStep::Kind::transfer:
        if (node.send_state != SendState::waiting)
          throw std::logic_error("a node began a transfer before its last one was sent");
        node.send_state = SendState::pending;
        node.at = std::max(step.at, now);
        node.out.assign(step.out.begin(), step.out.end());
        break;
      case FrameStep::Kind::configure:
        node.rate = step.rate;
        // The bus changes its bit rate when the last of its nodes has changed to the new rate.
        if (std::all_of(nodes_.begin(), nodes_.end(), [&](const Node& one) { return one.rate == node.rate; })) {
          rate_ = node.rate;
          configuring_ = true;
        }
        break;
      case FrameStep::Kind::done:
        node.send_state = SendState::done;
        return;
      case FrameStep::Kind::emit:
      case FrameStep::Kind::pulse:
        break;
    }
  }
}

FrameBus::Node* FrameBus::first_to_send() {
  Node* first = nullptr;
  for (Node& node : nodes_) {
    if (node.send_state != SendState::pending || node.rate != rate_) continue;
    if (first == nullptr || std::tie(node.at, node.out.front().id) < std::tie(first->at, first->out.front().id)) {
      first = &node;
    }
  }
  return first;
}

FrameStep FrameBus::next(Time now) {
  if (sender_ == nullptr) {
    for (Node& node : nodes_) serve(node, now);
  }
  if (std::exchange(configuring_, false)) {
    return {.kind = FrameStep::Kind::configure, .rate = rate_};
  }
  FrameStep step{.at = never};
  Node* const first = sender_ == nullptr ? first_to_send() : nullptr;
  if (first != nullptr && first->at <= now) {
    sender_ = first;
    first->send_state = SendState::sending;
    out_ = first->out.front();
    return {.kind = FrameStep::Kind::transfer, .out = {&out_, 1}};
  }
  if (first != nullptr) step.at = first->at;
  for (const Node& node : nodes_) {
    if (node.send_state != SendState::done) step.at = std::min(step.at, node.timer);
  }
  return step;
}

}  // namespace absenc::sim
