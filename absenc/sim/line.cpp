// SPDX-License-Identifier: Apache-2.0
// Main part of sim::Line: machines, time and deadlines. The wires are in line_wires.cpp.
#include "absenc/sim/line.hpp"

#include <algorithm>
#include <stdexcept>

#include "absenc/sim/line_state.hpp"

namespace absenc::sim {

template <class Item>
Line<Item>::Line(LinkKind kind, LineSettings settings) : kind_(kind), settings_(settings) {
  if (settings.rate == 0) throw std::invalid_argument("a line needs a rate");
}

template <class Item>
Line<Item>::~Line() = default;

template <class Item>
auto Line<Item>::attach(NodeRole role, Machine<Item>& machine, const OnEmit& on_emit) -> Node {
  auto state = std::make_unique<State>();
  state->role = role;
  state->machine = &machine;
  state->on_emit = on_emit;
  state->settings = settings_;
  state->silence = Silence(now_);
  nodes_.push_back(std::move(state));
  const Node node = nodes_.size() - 1;
  serve(node);
  return node;
}

template <class Item>
void Line<Item>::replace(Node node, Machine<Item>& machine) {
  State& state = *nodes_[node];
  state.machine = &machine;
  state.done = false;
  state.active_step = Step<Item>::Kind::wait;
  ++state.begin_generation;
  state.on_wire = 0;
  state.goes_on_from = never;
  state.silence = Silence(now_);
  serve(node);
}

template <class Item>
void Line<Item>::wake(Node node) {
  serve(node);
}

template <class Item>
void Line<Item>::set_echo(Node node, bool echo) {
  nodes_[node]->echo = echo;
}

template <class Item>
void Line<Item>::observe(Observer observer) {
  observer_ = std::move(observer);
}

template <class Item>
void Line<Item>::observe_transfers(TransferObserver observer) {
  transfer_observer_ = std::move(observer);
}

template <class Item>
void Line<Item>::observe_pulses(PulseObserver observer) {
  pulse_observer_ = std::move(observer);
}

template <class Item>
NodeRole Line<Item>::role(Node node) const {
  return nodes_[node]->role;
}

template <class Item>
bool Line<Item>::done(Node node) const {
  return nodes_[node]->done;
}

// Returns the node whose timer or silence event is due first.
template <class Item>
auto Line<Item>::next_deadline() const -> Node {
  Node first = 0;
  for (Node node = 1; node < nodes_.size(); ++node) {
    if (nodes_[node]->due < nodes_[first]->due) first = node;
  }
  return first;
}

template <class Item>
Time Line<Item>::next_event() const {
  if (nodes_.empty()) return never;
  const Time due = nodes_[next_deadline()]->due;
  return scheduled_.empty() ? due : std::min(due, scheduled_.top().at);
}

template <class Item>
Time Line<Item>::settled() const {
  Time time = now_;
  for (const auto& node : nodes_) {
    if (node->active_step != Step<Item>::Kind::transfer) continue;
    if (!node->begun && node->hold_low) time = std::min(time, node->accepted_at);
    if (!node->begun) continue;
    time = std::min(time, node->start + node->each * static_cast<std::int64_t>(node->index));
  }
  return time;
}

template <class Item>
void Line<Item>::schedule(typename ScheduledEvent::Kind kind, Time at, Node node) {
  scheduled_.push({kind, std::max(at, now_), order_++, node, nodes_[node]->begin_generation});
}

template <class Item>
bool Line<Item>::step() {
  using Kind = typename ScheduledEvent::Kind;
  const Time time = next_event();
  if (time == never) return false;
  now_ = time;
  // Events with the same time are handled in this order: scheduled events, timers and silences, arbitration of CAN
  // frames.
  const Node late = next_deadline();
  if (scheduled_.empty() || scheduled_.top().at > time ||
      (scheduled_.top().kind == Kind::arbitrate && nodes_[late]->due == time)) {
    deadline(late);
    return true;
  }
  const ScheduledEvent scheduled = scheduled_.top();
  scheduled_.pop();
  const Node node = scheduled.node;
  const bool current = scheduled.generation == nodes_[node]->begin_generation;
  switch (scheduled.kind) {
    case Kind::begin:
      if (current) begin(node);
      break;
    case Kind::character:
      if (current) end_character(node);
      break;
    case Kind::turned:
      if (current) turn_data_line(node);
      break;
    case Kind::transferred:
      if (current) end_transfer(node);
      break;
    case Kind::finished:
      if (current) finish(node);
      break;
    case Kind::frame:  // the CAN bus becomes free even if the machine of the sender was replaced
      frame_on_bus_ = false;
      if (current) end_frame(node);
      schedule(Kind::arbitrate, now_, node);
      break;
    case Kind::arbitrate:
      arbitrate();
      break;
  }
  return true;
}

template <class Item>
void Line<Item>::run_until(Time limit) {
  while (next_event() <= limit && step()) {
  }
  now_ = std::max(now_, limit);
}

template <class Item>
bool Line<Item>::run(Node node, Time limit) {
  while (!done(node)) {
    if (next_event() > limit || !step()) return false;
  }
  return true;
}

template <class Item>
void Line<Item>::feed(Node node, const Event<Item>& event) {
  if (nodes_[node]->done) return;
  nodes_[node]->machine->feed(event);
  serve(node);
}

// Takes steps from the node's machine until it waits or is done.
template <class Item>
void Line<Item>::serve(Node node) {
  using Kind = typename Step<Item>::Kind;
  State& state = *nodes_[node];
  while (!state.done) {
    const Step<Item> step = state.machine->next(now_);
    switch (step.kind) {
      case Kind::wait:
        state.waiting = step;
        state.timer_due = step.at > now_ ? step.at : never;
        arm(state);
        return;
      case Kind::emit:
        if (state.on_emit && !state.on_emit()) state.done = true;
        break;
      case Kind::done:
        state.done = true;
        break;
      case Kind::configure:
        state.settings.rate = step.rate;
        break;
      case Kind::transfer:
      case Kind::pulse:
        accept_step(node, step);
        break;
    }
  }
  state.due = never;  // the machine is done, so no timer or silence may wake it any more
}

template <class Item>
void Line<Item>::accept_step(Node node, const Step<Item>& step) {
  State& state = *nodes_[node];
  // On an SPI or clocked link a device answers into the transfer that is in progress.
  const bool driven = state.role == NodeRole::device && step.kind == Step<Item>::Kind::transfer && host_clocks(kind_);
  if (!driven && state.active_step != Step<Item>::Kind::wait) {
    throw std::logic_error("a machine began a transfer or pulse before its last one was sent");
  }
  state.active_step = step.kind;
  state.begun = false;
  state.out.assign(step.out.begin(), step.out.end());
  state.on_wire = 0;
  state.bits = step.bits;
  state.frame = step.frame;
  state.expect = step.expect;
  state.width = step.width;
  state.behind_out = step.behind_out();
  state.pulse_wire = step.wire;
  state.hold_low = step.hold_low;
  state.out_bits = step.out_bits;
  state.goes_on = step.goes_on;
  if (kind_ == LinkKind::clocked_bidirectional && step.rate != 0) state.settings.rate = step.rate;
  state.accepted_at = now_;
  ++state.begin_generation;
  // The begin is scheduled even for the present time, so that a node that is attached after this call still takes part.
  if (!driven) schedule(ScheduledEvent::Kind::begin, step.at, node);
}

template <class Item>
void Line<Item>::arm(State& state) {
  state.due = state.timer_due;
  if (state.active_step != Step<Item>::Kind::wait) return;
  state.due = std::min(state.due, std::max(now_, state.silence.due(state.waiting.answer, state.waiting.gap)));
}

template <class Item>
void Line<Item>::deadline(Node node) {
  State& state = *nodes_[node];
  if (state.timer_due <= now_) {
    state.timer_due = never;
    feed(node, {.kind = Event<Item>::Kind::timer, .at = now_});
    return;
  }
  // No silence is reported while another node sends characters to this one.
  if (busy_towards(state)) {
    state.due = std::min(now_ + state.settings.byte_time(), state.timer_due);
    return;
  }
  state.silence.reported();
  feed(node, {.kind = Event<Item>::Kind::silence, .at = now_});
}

template <class Item>
void Line<Item>::finish(Node node) {
  State& state = *nodes_[node];
  state.active_step = Step<Item>::Kind::wait;
  state.silence.sent(now_);
  feed(node, {.kind = Event<Item>::Kind::sent, .at = now_});
}

template class Line<std::uint8_t>;
template class Line<CanFrame>;

}  // namespace absenc::sim
