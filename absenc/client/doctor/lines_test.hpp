// SPDX-License-Identifier: Apache-2.0
// A scripted line for tests of doctor.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "absenc/client/port/virtual_link_test.hpp"

namespace absenc::client {

using namespace std::chrono_literals;

/// A line in virtual time on which the function `answer` makes the replies.
template <class Item>
class ScriptedPort final : public Port<Item> {
 public:
  using List = std::vector<Item>;
  std::function<List(const List& request)> answer = [](const List&) { return List{}; };
  List babble{};  // bytes or frames that another device sends by itself; empty: no other device
  Time babble_period = 1ms;
  Time after = 100us;
  Time latency{};
  bool destroys = false;  // whether a line error follows each request, as on a CAN bus without acknowledgement

  Time now() override { return now_; }
  void begin(const Step<Item>& step) override {
    if (step.kind == Step<Item>::Kind::configure) return;  // it has no time
    now_ = std::max(now_, step.at);
    if (step.kind != Step<Item>::Kind::transfer) return;
    quiet_since_ = now_;
    heard_ = told_ = false;
    due_.push_back({{.kind = Event<Item>::Kind::sent, .at = now_}, {}});
    if (destroys) due_.push_back({{.kind = Event<Item>::Kind::line_error, .at = now_ + after}, {}});
    List reply = answer({step.out.begin(), step.out.end()});
    if (!reply.empty()) due_.push_back({{.kind = Event<Item>::Kind::received, .at = now_ + after}, std::move(reply)});
  }
  Event<Item> wait(const Step<Item>& step) override {
    const Time timer = step.at > now_ ? step.at : never;
    const Time limit = heard_ ? step.gap : step.answer;
    const Time silence = limit > Time{} && !told_ ? std::max(now_, quiet_since_ + limit + latency) : never;
    const Time event = due_.empty() ? never : due_.front().event.at;
    const Time noise = babble.empty() ? never : std::max(now_, babble_at_);
    const Time first = std::min({timer, silence, event, noise});
    if (first == never) throw std::logic_error("a wait for what can never happen");
    now_ = std::max(now_, first);
    if (first == event) {
      current_ = std::move(due_.front());
      due_.pop_front();
      return tell(current_.event, current_.items);
    }
    if (first == noise) {
      babble_at_ = now_ + babble_period;
      return tell({.kind = Event<Item>::Kind::received, .at = now_}, babble);
    }
    if (first == silence) {
      told_ = true;
      return {.kind = Event<Item>::Kind::silence, .at = now_};
    }
    return {.kind = Event<Item>::Kind::timer, .at = now_};
  }

 private:
  struct Due {
    Event<Item> event;
    List items;
  };
  Event<Item> tell(Event<Item> event, const List& items) {
    if (event.kind == Event<Item>::Kind::received) {
      heard_ = true;
      told_ = false;
      quiet_since_ = now_;
      event.items = items;
    }
    return event;
  }

  Time now_{};
  Time quiet_since_{};
  Time babble_at_{};
  bool heard_ = false;
  bool told_ = false;
  std::deque<Due> due_;
  Due current_{};
};

inline Link link_to(std::shared_ptr<ScriptedPort<std::uint8_t>> port) {
  Link link;
  link.place = "here";
  link.latency = port->latency;
  link.bytes = port.get();
  link.owner = std::move(port);
  return link;
}

}  // namespace absenc::client
