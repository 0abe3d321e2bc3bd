// SPDX-License-Identifier: Apache-2.0
// The timer and the silence limit that end a port's wait, common to all ports.
#pragma once

#include <algorithm>
#include <optional>

#include "absenc/link/silence.hpp"
#include "absenc/link/step.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

/// The timing of a port: the time that its state machine knows, the requested timer, the silence limit.
template <class Item>
class Waiting {
 public:
  Waiting() = default;
  explicit Waiting(Time quiet_since) : silence(quiet_since) {}

  Silence silence;

  /// Returns the time that the state machine knows: that of the last call of `now` or of the last event.
  [[nodiscard]] Time known_time() const { return known_time_; }
  Time now() { return known_time_ = os::now(); }
  /// Returns `event` and records its time as the time that the state machine knows.
  Event<Item> report(const Event<Item>& event) {
    known_time_ = event.at;
    return event;
  }

  /// Starts a wait for the timer and the silence that `step` requests. `latency` is added to the silence limits.
  void begin(const Step<Item>& step, Time latency = {}) {
    timer_ = step.at > known_time_ || step.at == timer_ ? step.at : never;
    silence_ = silence.due(step.answer, step.gap, latency);
  }
  [[nodiscard]] Time due() const { return std::min(timer_, silence_); }
  /// Returns the timer or silence event if its time is reached at `time`, or nothing.
  std::optional<Event<Item>> take_due(Time time) {
    using Kind = typename Event<Item>::Kind;
    if (time < due()) return {};
    if (timer_ <= silence_) {
      timer_ = never;
      return report({.kind = Kind::timer, .at = time});
    }
    silence.reported();
    return report({.kind = Kind::silence, .at = time});
  }

 private:
  Time known_time_{};
  Time timer_ = never;    // time of the requested timer; `never` if no timer is to be reported
  Time silence_ = never;  // time at which silence is to be reported
};

}  // namespace absenc::os
