// SPDX-License-Identifier: Apache-2.0
// The rule by which ports and simulated lines report the event `silence`.
#pragma once

#include "absenc/link/step.hpp"

namespace absenc {

/// A timer for the `silence` event at one end of a line.
class Silence {
 public:
  Silence() = default;
  /// Makes a timer for a line that has been silent since the time `since`.
  explicit Silence(Time since) : since_(since) {}

  /// Records that this end of the line ended a transfer or pulse at `at`. Until an item is received, the limit `answer`
  /// of the step applies.
  void sent(Time at) { *this = Silence(at); }
  /// Records that an item was received at `at`. From now on the limit `gap` of the step applies.
  void received(Time at) {
    busy(at);
    received_ = true;
    reported_ = false;
  }
  /// Records activity that did not reach this end as an item: the line is silent since `at`.
  void busy(Time at) { since_ = at; }
  /// Records that the event `silence` was reported, so that it is reported only once.
  void reported() { reported_ = true; }

  /// Returns the time since which the line is silent.
  [[nodiscard]] Time since() const { return since_; }
  /// Returns whether an item was received since the last transfer or pulse.
  [[nodiscard]] bool has_received() const { return received_; }

  /// Returns when the event `silence` is due: after a silence of `answer`, or of `gap` if an item was received since
  /// the last transfer or pulse, plus `latency`. Returns `never` if the event was reported already or the limit is 0.
  [[nodiscard]] Time due(Time answer, Time gap, Time latency = {}) const {
    const Time limit = received_ ? gap : answer;
    return reported_ || limit <= Time{} ? never : since_ + limit + latency;
  }

 private:
  // begin of the silence: end of the last transfer or pulse of this end, or of the last other activity
  Time since_{};
  bool received_ = false;  // an item was received since the last transfer or pulse
  bool reported_ = false;
};

}  // namespace absenc
