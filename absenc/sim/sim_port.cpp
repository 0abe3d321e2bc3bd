// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/sim_port.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace absenc::sim {

template <class Item>
void SimPort<Item>::HostEnd::feed(const Event<Item>& event) {
  if (event.kind == Event<Item>::Kind::sent) sending = false;
  push(event);
}

template <class Item>
auto SimPort<Item>::HostEnd::queued(std::size_t number) -> QueuedEvent& {
  return ring_[(first_ + number) % ring_.size()];
}

template <class Item>
void SimPort<Item>::HostEnd::push(const Event<Item>& event) {
  if (queued_ == ring_.size()) {
    std::rotate(ring_.begin(), ring_.begin() + static_cast<std::ptrdiff_t>(first_), ring_.end());
    first_ = 0;
    ring_.emplace_back();
  }
  QueuedEvent& last = queued(queued_++);
  last.event = event;
  last.items.assign(event.items.begin(), event.items.end());
}

template <class Item>
Event<Item> SimPort<Item>::HostEnd::pop(std::vector<Item>& items) {
  QueuedEvent& oldest = queued(0);
  std::swap(items, oldest.items);
  first_ = (first_ + 1) % ring_.size();
  --queued_;
  return oldest.event;
}

template <class Item>
void SimPort<Item>::HostEnd::drop_sent() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < queued_; ++i) {
    if (queued(i).event.kind == Event<Item>::Kind::sent) continue;
    std::swap(queued(kept++), queued(i));
  }
  queued_ = kept;
}

template <class Item>
Step<Item> SimPort<Item>::HostEnd::next(Time) {
  return beginning != nullptr ? *std::exchange(beginning, nullptr) : waiting;
}

template <class Item>
SimPort<Item>::SimPort(LinkKind kind, LineSettings settings, Machine<Item>& device, RealTime real_time)
    : real_time_(std::move(real_time)), line_(kind, settings), host_node_(line_.attach(NodeRole::host, host_end_)) {
  line_.attach(NodeRole::device, device);
  if (!real_time_.now != !real_time_.sleep_until) {
    throw std::invalid_argument("a simulated port needs both now and sleep_until, or neither");
  }
  if (real_time_.now) start_ = real_time_.now();
}

template <class Item>
void SimPort<Item>::keep_pace() {
  if (real_time_.now) line_.run_until(real_time_.now() - start_);
}

template <class Item>
Time SimPort<Item>::now() {
  keep_pace();
  last_event_at_ = line_.now();
  return last_event_at_;
}

template <class Item>
void SimPort<Item>::begin(const Step<Item>& step) {
  keep_pace();
  using Kind = typename Step<Item>::Kind;
  if (step.kind == Kind::transfer || step.kind == Kind::pulse) {
    run_until([&] { return !host_end_.sending; });
    host_end_.drop_sent();
    host_end_.sending = true;
  }
  host_end_.beginning = &step;
  line_.wake(host_node_);
}

template <class Item>
Event<Item> SimPort<Item>::wait(const Step<Item>& step) {
  // If virtual time follows a real-time clock, the line may already have passed the time of the requested timer.
  const bool is_past = step.at > last_event_at_ && step.at <= line_.now();
  if (host_end_.empty() && is_past) host_end_.feed({.kind = Event<Item>::Kind::timer, .at = step.at});
  if (host_end_.empty()) advance(step);
  Event<Item> event = host_end_.pop(items_);
  last_event_at_ = event.at;
  event.items = items_;
  return event;
}

template <class Item>
void SimPort<Item>::advance(const Step<Item>& step) {
  // The `answer` and `gap` limits of a step apply only during the wait for which they were given.
  struct Disarm {
    SimPort& port;
    ~Disarm() {
      port.host_end_.waiting = {};
      port.line_.wake(port.host_node_);
    }
  };
  host_end_.waiting = step;
  line_.wake(host_node_);
  const Disarm disarm{*this};
  run_until([&] { return !host_end_.empty(); });
}

template <class Item>
template <class Done>
void SimPort<Item>::run_until(const Done& done) {
  // Duration of one sleep while the line has no event. It is short, because `sleep_until` may throw to end the wait.
  constexpr Time idle = std::chrono::milliseconds(100);
  while (!done()) {
    const Time due = line_.next_event();
    if (!real_time_.now) {
      if (!line_.step()) throw std::logic_error("a wait on a simulated line for what can never happen");
      continue;
    }
    const Time real = real_time_.now() - start_;
    if (due <= real) {
      line_.step();
    } else {
      real_time_.sleep_until(start_ + (due == never ? real + idle : due));
    }
  }
}

template class SimPort<std::uint8_t>;
template class SimPort<CanFrame>;

}  // namespace absenc::sim
