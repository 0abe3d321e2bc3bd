// SPDX-License-Identifier: Apache-2.0
// The port of an encoder that is tested: what came is kept, and a request may be another than the host's.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <vector>

#include "absenc/link/port.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

/// Keeps the last exchange as it was on the wire, and may send another request than the host's.
template <class Item>
class EditedPort final : public Port<Item> {
 public:
  explicit EditedPort(Port<Item>& port) : port_(port) {}
  Time now() override { return port_.now(); }
  void begin(const Step<Item>& step) override {
    Step<Item> edited = step;
    if (step.kind == Step<Item>::Kind::transfer) {
      request_.assign(step.out.begin(), step.out.end());
      if (edit) edit(request_);
      edited.out = request_;
      answer = step.answer;
      if (asked && received.empty()) ++unanswered;
      asked = true;
      received.clear();
      after = Time{};
      echo_due_ = echoes ? request_.size() : 0;
    }
    port_.begin(edited);
  }
  // Once, so that what was changed can still be put back.
  Event<Item> wait(const Step<Item>& step) override {
    if (!ended && over && over()) {
      ended = true;
      throw os::Interrupted{};
    }
    const Event<Item> event = port_.wait(step);
    if (event.kind == Event<Item>::Kind::sent) sent_at_ = event.at;
    if (event.kind == Event<Item>::Kind::received) hear(event);
    return event;
  }
  /// Until the time is over.
  void listen(Time time) {
    const Step<Item> step{.at = port_.now() + time};
    while (port_.now() < step.at) {
      if (wait(step).kind == Event<Item>::Kind::timer) return;
    }
  }
  void forget() {
    received.clear();
    after = Time{};
    echo_due_ = 0;
    asked = false;
    unanswered = 0;
  }

  std::function<bool()> over{};
  bool ended = false;  // because of `over`
  std::function<void(std::vector<Item>&)> edit{};
  std::vector<Item> received{};
  Time answer{};
  Time after{};      // from the end of the request to the beginning of the reply
  Time character{};  // of the line; 0: frames are not made of characters
  bool asked = false;
  unsigned unanswered = 0;  // requests behind which another came at once
  bool echoes = false;      // what is sent comes back before the reply

 private:
  // By count, as a reply may begin as its request does.
  void hear(const Event<Item>& event) {
    const std::size_t echo = std::min(echo_due_, event.items.size());
    echo_due_ -= echo;
    const auto items = event.items.subspan(echo);
    if (received.empty() && !items.empty()) after = event.at - sent_at_ - late_by(items.size());
    received.insert(received.end(), items.begin(), items.end());
  }
  // Items are told at their end.
  [[nodiscard]] Time late_by(std::size_t items) const { return character * static_cast<std::int64_t>(items); }

  Port<Item>& port_;
  std::vector<Item> request_;
  Time sent_at_{};
  std::size_t echo_due_ = 0;
};

}  // namespace absenc::client
