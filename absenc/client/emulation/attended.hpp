// SPDX-License-Identifier: Apache-2.0
// How a virtual encoder is driven by a port: others can do something to it between its steps.
#pragma once

#include <algorithm>
#include <functional>
#include <utility>

#include "absenc/link/step.hpp"

namespace absenc::client {

/// A host on a pseudo-terminal waits milliseconds for what takes microseconds on a wire: a transfer due so soon is sent
/// at once.
inline constexpr Time send_slack = std::chrono::microseconds(500);

/// Nothing else runs while `look` does: no thread touches an encoder beside its carrier, and every carrier has timers.
template <class Item>
class Attended final : public Machine<Item> {
 public:
  /// `look` is called every 20 ms and at each step that comes later; it returns false when it is not to be called
  /// again.
  Attended(Machine<Item>& machine, std::function<bool(Time now)> look) : machine_(machine), look_(std::move(look)) {}

  void feed(const Event<Item>& event) override {
    if (event.kind == Event<Item>::Kind::timer) {
      if (event.at < timer_) return;  // only to look
      timer_ = never;
    }
    machine_.feed(event);
  }

  Step<Item> next(Time now) override {
    constexpr Time between_looks = std::chrono::milliseconds(20);
    if (now >= look_at_) look_at_ = look_(now) ? now + between_looks : never;
    Step<Item> step = machine_.next(now);
    if (step.kind != Step<Item>::Kind::wait) return step;
    // As ports have it: a timer that was due in the moment of another event stays due.
    timer_ = step.at > now || step.at == timer_ ? step.at : never;
    step.at = std::min(look_at_, timer_);
    return step;
  }

 private:
  Machine<Item>& machine_;
  std::function<bool(Time)> look_;
  Time timer_ = never;  // of the machine's last wait
  Time look_at_{};
};

}  // namespace absenc::client
