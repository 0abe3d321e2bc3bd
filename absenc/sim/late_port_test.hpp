// SPDX-License-Identifier: Apache-2.0
// A port that delays received items, like a USB hiccup or a network. It keeps their order and runs in virtual time.
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
  /// `delay` is called once per reply and returns its delay, or `never` if the reply is lost.
  LatePort(SimPort<Item>& inner, std::function<Time()> delay) : inner_(&inner), delay_(std::move(delay)) {}

  Time now() override {
    time_ = std::max(time_, inner_->now());
    told_ = time_;
    return time_;
  }

  void begin(const Step<Item>& step) override {
    if (step.kind == Step<Item>::Kind::transfer || step.kind == Step<Item>::Kind::pulse) {
      // The line's time may be behind this port's time: the transfer begins now.
      rest(std::max(time_, step.at));
      quiet_since_ = time_;
      heard_ = silence_told_ = false;
      answering_ = false;
    }
    inner_->begin(step);
  }

  Event<Item> wait(const Step<Item>& step) override {
    using Kind = typename Event<Item>::Kind;
    const Time armed = step.at > told_ ? step.at : never;
    for (;;) {
      const Time limit = heard_ ? step.gap : step.answer;
      const Time quiet_end = limit > Time{} && !silence_told_ ? quiet_since_ + limit : never;
      const Time due = std::min({armed, quiet_end, held_.empty() ? never : held_.front().at});
      if (!held_.empty() && held_.front().at <= time_) {
        told_items_ = std::move(held_.front().items);
        held_.pop_front();
        heard_ = true;
        silence_told_ = false;
        quiet_since_ = time_;
        return tell({.kind = Kind::received, .at = time_, .items = told_items_});
      }
      if (due <= time_) {
        if (armed <= quiet_end) return tell({.kind = Kind::timer, .at = time_});
        silence_told_ = true;
        return tell({.kind = Kind::silence, .at = time_});
      }
      const Event<Item> event = inner_->wait({.at = due == never ? time_ + std::chrono::hours(1) : due});
      time_ = std::max(time_, event.at);
      if (event.kind == Kind::received) hold(event);
      if (event.kind == Kind::sent) {
        quiet_since_ = event.at;
        return tell(event);
      }
    }
  }

  /// Advances the time to `until`; items received meanwhile are delivered later.
  void rest(Time until) {
    while (time_ < until) {
      const Event<Item> event = inner_->wait({.at = until});
      time_ = std::max(time_, event.at);
      if (event.kind == Event<Item>::Kind::received) hold(event);
    }
  }

 private:
  struct Held {
    Time at;
    std::vector<Item> items;
  };

  void hold(const Event<Item>& event) {
    if (!std::exchange(answering_, true)) late_ = delay_();
    if (late_ == never) return;
    const Time at = std::max(event.at + late_, held_.empty() ? Time{} : held_.back().at);
    held_.push_back({at, {event.items.begin(), event.items.end()}});
  }

  Event<Item> tell(const Event<Item>& event) {
    told_ = event.at;
    return event;
  }

  SimPort<Item>* inner_;
  std::function<Time()> delay_;
  std::deque<Held> held_;
  std::vector<Item> told_items_;
  Time time_{};
  Time told_{};
  Time quiet_since_{};
  Time late_{};
  bool heard_ = false;
  bool silence_told_ = false;
  bool answering_ = false;  // an item was received since the last request
};

}  // namespace absenc::sim::testing
