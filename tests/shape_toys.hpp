// SPDX-License-Identifier: Apache-2.0
// Toy machines for tests of the machine interface and of the simulator.
#pragma once

#include <deque>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "absenc/link/step.hpp"

namespace absenc::toy {

using Byte = std::uint8_t;

inline std::string hex(unsigned value, int digits) {
  std::string text;
  for (int i = digits - 1; i >= 0; --i) text += "0123456789ABCDEF"[(value >> (4 * i)) & 0xF];
  return text;
}
inline std::string text_of(Byte byte) { return hex(byte, 2); }
inline std::string text_of(const CanFrame& frame) {
  std::string text = hex(frame.id, frame.extended ? 8 : 3) + ':';
  for (const Byte byte : frame.bytes()) text += hex(byte, 2);
  return text;
}

// A machine that logs each event, calls a function with it, and returns the steps that the function has queued.
template <class Item>
class Toy final : public Machine<Item> {
 public:
  using Kind = typename Event<Item>::Kind;
  using React = std::function<void(Toy&, const Event<Item>&)>;

  explicit Toy(React react = {}) : react_(std::move(react)) {}

  void feed(const Event<Item>& event) override {
    static constexpr const char* names[] = {"sent", "received", "silence", "timer", "selected", "triggered", "error"};
    log += (log.empty() ? "" : ", ") + std::to_string(event.at.count()) + ' ' + names[static_cast<int>(event.kind)];
    for (const Item& item : event.items) log += ' ' + text_of(item);
    if (event.bits != 0) log += ' ' + std::to_string(event.bits);
    if (event.width.count() != 0) log += ' ' + std::to_string(event.width.count());
    if (react_) react_(*this, event);
  }
  Step<Item> next(Time) override {
    if (queue_.empty()) return idle;
    Queued queued = std::move(queue_.front());
    queue_.pop_front();
    out_ = std::move(queued.items);
    queued.step.out = out_;
    return queued.step;
  }

  void push(Step<Item> step) { queue_.push_back({step, {}}); }
  void send(std::vector<Item> items, Time at = {}, std::size_t bits = 0, std::size_t expect = 0) {
    queue_.push_back(
        {{.kind = Step<Item>::Kind::transfer, .expect = expect, .bits = bits, .at = at}, std::move(items)});
  }
  // Queues a transfer on a bidirectional clocked link, of `bits` clocks in all: the machine sends the first `out_bits`
  // bits of the items, the other end sends during the remaining clocks.
  void exchange(std::vector<Item> items, std::size_t out_bits, std::size_t bits, bool goes_on = false, Time at = {}) {
    queue_.push_back(
        {{.kind = Step<Item>::Kind::transfer, .goes_on = goes_on, .bits = bits, .out_bits = out_bits, .at = at},
         std::move(items)});
  }
  void emit() { push({.kind = Step<Item>::Kind::emit}); }
  void finish() { push({.kind = Step<Item>::Kind::done}); }

  Step<Item> idle{};  // the step that the machine returns while no step is queued
  std::string log;

 private:
  struct Queued {
    Step<Item> step;
    std::vector<Item> items;
  };
  React react_;
  std::deque<Queued> queue_;
  std::vector<Item> out_;
};

}  // namespace absenc::toy
