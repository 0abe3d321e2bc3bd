// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/sim_port.hpp"

#include <stdexcept>
#include <utility>

namespace absenc::sim {

template <class Item>
void SimPort<Item>::Hand::feed(const Event<Item>& event) {
  heard.push_back({event, {event.items.begin(), event.items.end()}});
}

template <class Item>
Step<Item> SimPort<Item>::Hand::next(Time) {
  return beginning != nullptr ? *std::exchange(beginning, nullptr) : waiting;
}

template <class Item>
SimPort<Item>::SimPort(LinkKind kind, LineSettings settings, Machine<Item>& device, RealTime real_time)
    : real_time_(std::move(real_time)), line_(kind, settings), host_node_(line_.attach(Role::host, hand_)) {
  line_.attach(Role::device, device);
  if (!real_time_.now != !real_time_.sleep_until) {
    throw std::invalid_argument("a simulated port needs both now and sleep_until, or neither");
  }
  if (real_time_.now) start_ = real_time_.now();
}

// What was due by now has happened, whether somebody waited for it or not.
template <class Item>
void SimPort<Item>::keep_pace() {
  if (real_time_.now) line_.run_until(real_time_.now() - start_);
}

template <class Item>
Time SimPort<Item>::now() {
  keep_pace();
  return line_.now();
}

template <class Item>
void SimPort<Item>::begin(const Step<Item>& step) {
  keep_pace();
  hand_.beginning = &step;
  line_.wake(host_node_);
}

template <class Item>
Event<Item> SimPort<Item>::wait(const Step<Item>& step) {
  if (hand_.heard.empty()) advance(step);
  Event<Item> event = hand_.heard.front().event;
  items_ = std::move(hand_.heard.front().items);
  hand_.heard.pop_front();
  event.items = items_;
  return event;
}

template <class Item>
void SimPort<Item>::advance(const Step<Item>& step) {
  // The limits hold while somebody waits, so that none is told for a step that is long over.
  struct Disarm {
    SimPort& port;
    ~Disarm() {
      port.hand_.waiting = {};
      port.line_.wake(port.host_node_);
    }
  };
  hand_.waiting = step;
  line_.wake(host_node_);
  const Disarm disarm{*this};
  constexpr Time idle = std::chrono::milliseconds(100);  // nothing will happen, but a sleep may be broken off
  while (hand_.heard.empty()) {
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
