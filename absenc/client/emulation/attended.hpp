// SPDX-License-Identifier: Apache-2.0
// Runs a virtual encoder on a port and calls other code between the encoder's steps.
#pragma once

#include <algorithm>
#include <functional>
#include <utility>

#include "absenc/link/step.hpp"

namespace absenc::client {

/// Longest time by which a virtual encoder may send its reply too early.
inline constexpr Time send_slack = std::chrono::microseconds(500);

/// A machine that calls `look` in the thread of the encoder.
template <class Item>
class Attended final : public Machine<Item> {
 public:
  /// Calls `look` every 20 ms, or at the next step after that, until `look` returns false.
  Attended(Machine<Item>& machine, std::function<bool(Time now)> look) : machine_(machine), look_(std::move(look)) {}

  void feed(const Event<Item>& event) override {
    if (event.kind == Event<Item>::Kind::timer) {
      // A timer event that comes before the time for which the encoder waits is only an occasion to call `look`. It is
      // not passed to the encoder.
      if (event.at < timer_) return;
      timer_ = never;
    }
    machine_.feed(event);
  }

  Step<Item> next(Time now) override {
    constexpr Time between_looks = std::chrono::milliseconds(20);
    if (now >= look_at_) look_at_ = look_(now) ? now + between_looks : never;
    Step<Item> step = machine_.next(now);
    if (step.kind != Step<Item>::Kind::wait) return step;
    // A wait of the encoder for a time that has passed needs no timer event, unless it is the wait whose timer is still
    // running.
    timer_ = step.at > now || step.at == timer_ ? step.at : never;
    step.at = std::min(look_at_, timer_);
    return step;
  }

 private:
  Machine<Item>& machine_;
  std::function<bool(Time)> look_;
  Time timer_ = never;  // time for which the encoder waits with a timer
  Time look_at_{};
};

}  // namespace absenc::client
