// SPDX-License-Identifier: Apache-2.0
// Runs a virtual encoder on a port and calls other code between the encoder's steps.
#pragma once

#include <algorithm>
#include <functional>
#include <utility>

#include "absenc/link/step.hpp"

namespace absenc::client {

/// Longest time by which the encoder may send before the time of its reply.
inline constexpr Time send_slack = std::chrono::microseconds(500);

/// A machine that calls `look` in the thread of the encoder.
template <class Item>
class Attended final : public Machine<Item> {
 public:
  /// Calls `look` every 20 ms, or at the next step after that, until `look` returns false.
  Attended(Machine<Item>& machine, std::function<bool(Time now)> look) : machine_(machine), look_(std::move(look)) {}

  void feed(const Event<Item>& event) override {
    if (event.kind == Event<Item>::Kind::timer) {
      if (event.at < timer_) return;  // the timer was due only to call `look`, not for the encoder
      timer_ = never;
    }
    machine_.feed(event);
  }

  Step<Item> next(Time now) override {
    constexpr Time between_looks = std::chrono::milliseconds(20);
    if (now >= look_at_) look_at_ = look_(now) ? now + between_looks : never;
    Step<Item> step = machine_.next(now);
    if (step.kind != Step<Item>::Kind::wait) return step;
    // A time that has passed starts no timer, unless it is that of the present timer.
    timer_ = step.at > now || step.at == timer_ ? step.at : never;
    step.at = std::min(look_at_, timer_);
    return step;
  }

 private:
  Machine<Item>& machine_;
  std::function<bool(Time)> look_;
  Time timer_ = never;  // time of the timer for which the encoder waits
  Time look_at_{};
};

}  // namespace absenc::client
