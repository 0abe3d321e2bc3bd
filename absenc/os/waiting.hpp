// SPDX-License-Identifier: Apache-2.0
// What a wait ends with when nothing comes, alike for every port.
#pragma once

#include <algorithm>
#include <optional>

#include "absenc/link/silence.hpp"
#include "absenc/link/step.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

/// What a port knows of its machine: its time, the timer that it was promised, and how long nothing came.
template <class Item>
class Waiting {
 public:
  Waiting() = default;
  explicit Waiting(Time quiet_since) : silence(quiet_since) {}

  Silence silence;

  /// The time that the machine knows: of `now`, or of its last event.
  [[nodiscard]] Time told() const { return told_; }
  Time now() { return told_ = os::now(); }
  /// An event may be told late: a timer behind its time is still to come.
  Event<Item> tell(const Event<Item>& event) {
    told_ = event.at;
    return event;
  }

  /// Who waits with this step. A timer stays due when another event came in its moment and the machine asks for it once
  /// more.
  void begin(const Step<Item>& step, Time latency = {}) {
    timer_ = step.at > told_ || step.at == timer_ ? step.at : never;
    silence_ = silence.due(step.answer, step.gap, latency);
  }
  [[nodiscard]] Time due() const { return std::min(timer_, silence_); }
  /// The timer or the silence that is due at this time, or nothing.
  std::optional<Event<Item>> over(Time time) {
    using Kind = typename Event<Item>::Kind;
    if (time < due()) return {};
    if (timer_ <= silence_) {
      timer_ = never;
      return tell({.kind = Kind::timer, .at = time});
    }
    silence.told();
    return tell({.kind = Kind::silence, .at = time});
  }

 private:
  Time told_{};
  Time timer_ = never;    // that was promised and not yet told
  Time silence_ = never;  // that is to be told in this wait
};

}  // namespace absenc::os
