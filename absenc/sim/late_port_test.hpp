// SPDX-License-Identifier: Apache-2.0
// A port that delays or loses received items, in virtual time.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <utility>
#include <vector>

#include "absenc/sim/sim_port.hpp"

namespace absenc::sim::testing {

template <class Item>
class LatePort final : public Port<Item> {
 public:
  /// Makes a port behind `inner`. `delay` is called for each request and returns the delay of the items received after
  /// it, or `never` if they are lost.
  LatePort(SimPort<Item>& inner, std::function<Time()> delay) : inner_(&inner), delay_(std::move(delay)) {}

  Time now() override {
    time_ = std::max(time_, inner_->now());
    last_event_at_ = time_;
    return time_;
  }

  void begin(const Step<Item>& step) override {
    if (step.kind == Step<Item>::Kind::transfer || step.kind == Step<Item>::Kind::pulse) {
      // Stores the items that arrive before the next transfer begins.
      rest(std::max(time_, step.at));
      quiet_since_ = time_;
      received_ = silence_reported_ = false;
      reply_begun_ = false;
    }
    inner_->begin(step);
  }

  Event<Item> wait(const Step<Item>& step) override {
    using Kind = typename Event<Item>::Kind;
    const Time armed = step.at > last_event_at_ ? step.at : never;
    for (;;) {
      const Time limit = received_ ? step.gap : step.answer;
      const Time quiet_end = limit > Time{} && !silence_reported_ ? quiet_since_ + limit : never;
      const Time due = std::min({armed, quiet_end, delayed_.empty() ? never : delayed_.front().at});
      if (!delayed_.empty() && delayed_.front().at <= time_) {
        reported_items_ = std::move(delayed_.front().items);
        delayed_.pop_front();
        received_ = true;
        silence_reported_ = false;
        quiet_since_ = time_;
        return report({.kind = Kind::received, .at = time_, .items = reported_items_});
      }
      if (due <= time_) {
        if (armed <= quiet_end) return report({.kind = Kind::timer, .at = time_});
        silence_reported_ = true;
        return report({.kind = Kind::silence, .at = time_});
      }
      const Event<Item> event = inner_->wait({.at = due == never ? time_ + std::chrono::hours(1) : due});
      time_ = std::max(time_, event.at);
      if (event.kind == Kind::received) enqueue(event);
      if (event.kind == Kind::sent) {
        quiet_since_ = event.at;
        return report(event);
      }
    }
  }

  void rest(Time until) {
    while (time_ < until) {
      const Event<Item> event = inner_->wait({.at = until});
      time_ = std::max(time_, event.at);
      if (event.kind == Event<Item>::Kind::received) enqueue(event);
    }
  }

 private:
  struct DelayedItems {
    Time at;
    std::vector<Item> items;
  };

  void enqueue(const Event<Item>& event) {
    if (!std::exchange(reply_begun_, true)) late_ = delay_();
    if (late_ == never) return;
    const Time at = std::max(event.at + late_, delayed_.empty() ? Time{} : delayed_.back().at);
    delayed_.push_back({at, {event.items.begin(), event.items.end()}});
  }

  Event<Item> report(const Event<Item>& event) {
    last_event_at_ = event.at;
    return event;
  }

  SimPort<Item>* inner_;
  std::function<Time()> delay_;
  std::deque<DelayedItems> delayed_;
  std::vector<Item> reported_items_;
  Time time_{};
  Time last_event_at_{};
  Time quiet_since_{};
  Time late_{};
  bool received_ = false;
  bool silence_reported_ = false;
  bool reply_begun_ = false;  // true: an item was received since the host's last request
};

}  // namespace absenc::sim::testing
