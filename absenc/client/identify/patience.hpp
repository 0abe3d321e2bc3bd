// SPDX-License-Identifier: Apache-2.0
// Limits how long a conversation with an unknown encoder continues.
#pragma once

#include <algorithm>
#include <cstddef>

#include "absenc/link/step.hpp"

namespace absenc::client {

/// Decides when to end a conversation without replies, or without valid ones. Time in which the operating system did
/// not run this process does not count.
template <class Item>
class Patience {
 public:
  struct Limits {
    Time quiet{};  // longest time without any received byte or frame, after which the conversation ends
    // longest time with received bytes or frames but without a good reply, after which the conversation ends
    Time nonsense{};
    bool is_one_request = false;  // whether the conversation ends as soon as one request got no answer at all
    Time latency{};               // latency of the port, which is added to the timeouts of the conversation's steps
  };
  explicit Patience(const Limits& limits) : limits_(limits) {}

  /// Takes each event of the conversation, without the echo of requests.
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
  /// Takes each step of the conversation, and the time at which it begins.
  void see(const Step<Item>& step, Time now) {
    using Kind = typename Step<Item>::Kind;
    if (step.kind == Kind::transfer) {
      asked_ = answered_ = false;
      has_asked_ = true;
    }
    due_ = step.kind == Kind::wait ? due(step, now) : never;
  }
  /// Returns whether a limit is reached, so that the step must not be made. To be called only if no good reply has
  /// arrived.
  [[nodiscard]] bool is_over(const Step<Item>& step, Time now) {
    if (begun_ == never) begun_ = now;
    using Kind = typename Step<Item>::Kind;
    if (limits_.is_one_request && has_asked_ && heard_ == 0 && step.kind == Kind::transfer) return true;
    return now - begun_ - missed_ >= (heard_ == 0 ? limits_.quiet : limits_.nonsense);
  }
  [[nodiscard]] std::size_t heard() const { return heard_; }

 private:
  // Returns the time at which the port must return from the wait `step`.
  [[nodiscard]] Time due(const Step<Item>& step, Time now) const {
    const Time limit = answered_ ? step.gap : step.answer;
    const Time quiet_end = asked_ && limit != Time{} ? quiet_since_ + limit + limits_.latency : never;
    const Time latest = std::min(step.at > now ? step.at : never, quiet_end);
    return latest > now ? latest : never;
  }

  Limits limits_;
  std::size_t heard_ = 0;   // number of bytes or frames that were received in the conversation
  bool has_asked_ = false;  // whether the sending of a request has begun
  bool asked_ = false;      // whether the last request was sent
  bool answered_ = false;   // whether any byte or frame was received after the last request
  Time begun_ = never;
  Time missed_{};  // sum of the delays between due events and their handling by this process
  Time due_ = never;
  Time quiet_since_{};
};

}  // namespace absenc::client
