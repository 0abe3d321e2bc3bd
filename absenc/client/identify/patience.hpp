// SPDX-License-Identifier: Apache-2.0
// How long a conversation with somebody unknown is gone on with.
#pragma once

#include <algorithm>
#include <cstddef>

#include "absenc/link/step.hpp"

namespace absenc::client {

/// Ends a conversation that nobody answers, or nobody who makes sense. Time in which nobody looked, because this
/// process did not run, counts neither as quiet nor as nonsense.
template <class Item>
class Patience {
 public:
  struct Limits {
    Time quiet{};     // without a single item
    Time nonsense{};  // without a good reply
    Time latency{};   // that the port adds to the limits of a step
  };
  explicit Patience(const Limits& limits) : limits_(limits) {}

  /// Each event of the conversation, without echo.
  void see(const Event<Item>& event) {
    using Kind = typename Event<Item>::Kind;
    if (event.at > due_) missed_ += event.at - due_;
    if (event.kind == Kind::received) {
      heard_ += event.items.size();
      answered_ = true;
    }
    if (event.kind == Kind::sent) asked_ = true;
    if (event.kind == Kind::sent || event.kind == Kind::received) quiet_since_ = event.at;
  }
  /// Each step of the conversation.
  void see(const Step<Item>& step, Time now) {
    using Kind = typename Step<Item>::Kind;
    if (step.kind == Kind::transfer) asked_ = answered_ = false;
    due_ = step.kind == Kind::wait ? due(step, now) : never;
  }
  /// Whether it has lasted too long, unless somebody was understood.
  [[nodiscard]] bool is_over(Time now) {
    if (begun_ == never) begun_ = now;
    return now - begun_ - missed_ >= (heard_ == 0 ? limits_.quiet : limits_.nonsense);
  }
  [[nodiscard]] std::size_t heard() const { return heard_; }

 private:
  // When the port is to be back at the latest.
  [[nodiscard]] Time due(const Step<Item>& step, Time now) const {
    const Time limit = answered_ ? step.gap : step.answer;
    const Time quiet_end = asked_ && limit != Time{} ? quiet_since_ + limit + limits_.latency : never;
    const Time latest = std::min(step.at > now ? step.at : never, quiet_end);
    return latest > now ? latest : never;
  }

  Limits limits_;
  std::size_t heard_ = 0;  // items
  bool asked_ = false;     // the last request has left
  bool answered_ = false;  // something came behind it
  Time begun_ = never;
  Time missed_{};  // between what was due and when it was looked at
  Time due_ = never;
  Time quiet_since_{};
};

}  // namespace absenc::client
