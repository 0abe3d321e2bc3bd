// SPDX-License-Identifier: Apache-2.0
// A port that stores the last exchange, and ends waits that take too long.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "absenc/link/port.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

/// A request and all bytes or frames that were received until the next request; those beyond a limit are dropped.
template <class Item>
struct LineExchange {
  std::vector<Item> request{};
  std::vector<Item> received{};  // received bytes or frames, including the adapter's echo of the request
  std::size_t echo = 0;          // number of bytes or frames at the beginning of `received` that are the adapter's echo
  std::size_t clocks = 0;        // clocked line: number of clocks of the reply; 0 on other lines
  Time answer{};                 // longest time from the end of the request to the beginning of the reply; 0: no limit
  Time sent_at{};                // time at which the last bit of the request was sent
  Time sent_late{};              // uncertainty of `sent_at`: the request may have ended earlier by up to this time
  Time received_at{};            // time at which the last received byte or frame ended
  /// A time, and how many bytes or frames of `received` had arrived by then.
  struct Mark {
    Time at{};
    std::size_t items = 0;
  };
  std::vector<Mark> marks{};

  [[nodiscard]] std::span<const Item> reply() const {
    return std::span<const Item>(received).subspan(std::min(echo, received.size()));
  }
  /// Returns the time from the end of the request to the beginning of the reply; 0 without a reply.
  [[nodiscard]] Time answered_after(Time character) const {
    const auto first = std::find_if(marks.begin(), marks.end(), [this](const Mark& one) { return one.items > echo; });
    if (first == marks.end()) return {};
    return first->at - sent_at - character * static_cast<std::int64_t>(first->items - echo);
  }
  /// Clears the exchange without releasing memory.
  void clear() {
    request.clear();
    received.clear();
    marks.clear();
    echo = clocks = 0;
    answer = sent_at = sent_late = received_at = {};
  }
};

/// Thrown when a wait reaches the port's deadline.
struct OutOfTime {};

template <class Item>
class WatchedPort final : public Port<Item> {
 public:
  /// Reserves memory for received bytes or frames, so that most exchanges need no allocation.
  WatchedPort() {
    last.received.reserve(most_kept);
    last.marks.reserve(most_kept);
  }

  /// Sets the port to use from now on.
  void attach(Port<Item>& port) {
    port_ = &port;
    rate_ = 0;
  }
  /// Sets the port back to `rate`, if a conversation that was aborted has changed the rate.
  void return_to(std::uint32_t rate) {
    if (rate_ != 0 && rate_ != rate) begin({.kind = Step<Item>::Kind::configure, .rate = rate});
  }

  Time now() override { return looked_at_ = port_->now(); }

  void begin(const Step<Item>& step) override {
    using Kind = typename Step<Item>::Kind;
    if (step.kind == Kind::transfer || step.kind == Kind::pulse) {
      last.clear();
      last.request.assign(step.out.begin(), step.out.end());
      last.clocks = step.bits - step.out_bits;
      last.answer = step.answer;
      ++requests;
      items_sent += step.out.size();
    }
    port_->begin(step);
    if (step.kind == Kind::configure) rate_ = step.rate;
  }

  Event<Item> wait(const Step<Item>& step) override {
    const Event<Item> event = wait_or_abort(step);
    looked_at_ = event.at;
    if (event.at >= deadline) throw OutOfTime{};
    if (event.kind == Event<Item>::Kind::sent) {
      last.sent_at = event.at;
      last.sent_late = event.late;
    }
    const bool nothing_came = event.kind == Event<Item>::Kind::timer || event.kind == Event<Item>::Kind::silence;
    if (nothing_came) nothing_until = event.at;
    if (event.kind == Event<Item>::Kind::line_error) ++line_errors;
    if (event.kind == Event<Item>::Kind::received) {
      last.received_at = event.at;
      items_received += event.items.size();
      if (last.received.size() < most_kept) {
        last.received.insert(last.received.end(), event.items.begin(), event.items.end());
        last.marks.push_back({event.at, last.received.size()});
      }
    }
    return event;
  }

  /// Returns whether a conversation was asked to end early since this function was called last.
  [[nodiscard]] bool take_aborted() { return std::exchange(aborted_, false); }

  // function that is polled during waits; true ends them with os::Ended
  std::function<bool()> over;
  // function that asks the conversation to end early; returns false if it cannot end by itself
  std::function<bool()> abort;
  // end of the time that a conversation has, by the port's clock; a wait that reaches it throws OutOfTime
  Time deadline = never;
  LineExchange<Item> last;
  Time nothing_until{};  // time at which a wait last ended because its time was over or the line was silent
  std::uint64_t requests = 0;
  std::uint64_t items_sent = 0;
  std::uint64_t items_received = 0;
  std::uint64_t line_errors = 0;

 private:
  Event<Item> wait_or_abort(const Step<Item>& step) {
    for (;;) {
      try {
        if (over && over()) throw os::Ended{};
        const os::CancelCheck cancel_check(over);
        return port_->wait(bounded(step));
      } catch (const os::Interrupted&) {
        if (!abort()) throw;
        aborted_ = true;
      }
    }
  }
  // Compares the deadline with the time that was read last, because the time of the step may pass before the wait
  // begins.
  [[nodiscard]] Step<Item> bounded(const Step<Item>& step) const {
    if (deadline == never) return step;
    if (deadline <= looked_at_) throw OutOfTime{};
    Step<Item> sooner = step;
    sooner.at = std::min(step.at > looked_at_ ? step.at : never, deadline);
    return sooner;
  }

  static constexpr std::size_t most_kept = 1024;
  Port<Item>* port_ = nullptr;
  Time looked_at_{};        // time that was read last from the port's clock
  std::uint32_t rate_ = 0;  // baud or bit rate that a conversation set, in bits per second; 0: no conversation set one
  bool aborted_ = false;
};

}  // namespace absenc::client
