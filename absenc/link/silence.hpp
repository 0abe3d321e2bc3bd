// SPDX-License-Identifier: Apache-2.0
// When a machine is told that nothing came: the rule that all ports and simulated lines follow.
#pragma once

#include "absenc/link/step.hpp"

namespace absenc {

/// The silence at one end of a line: it is told once for each transfer, and once for what came after it, when the line
/// was quiet for as long as the machine's last step says.
class Silence {
 public:
  Silence() = default;
  explicit Silence(Time since) : since_(since) {}

  /// A transfer or pulse of this end is over: its answer is waited for.
  void sent(Time at) { *this = Silence(at); }
  /// Something came: now the gap counts.
  void heard(Time at) {
    busy(at);
    heard_ = true;
    told_ = false;
  }
  /// The line was not quiet, though nothing came that concerns this end.
  void busy(Time at) { since_ = at; }
  void told() { told_ = true; }

  [[nodiscard]] Time since() const { return since_; }
  [[nodiscard]] bool has_heard() const { return heard_; }

  /// When `silence` is to be told to whoever waits with these limits (Step::answer and gap); `latency`: what the way to
  /// the line adds to them. `never`: not before something is sent or comes.
  [[nodiscard]] Time due(Time answer, Time gap, Time latency = {}) const {
    const Time limit = heard_ ? gap : answer;
    return told_ || limit <= Time{} ? never : since_ + limit + latency;
  }

 private:
  Time since_{};        // the end of the last transfer, or of what came last
  bool heard_ = false;  // since the last transfer
  bool told_ = false;
};

}  // namespace absenc
