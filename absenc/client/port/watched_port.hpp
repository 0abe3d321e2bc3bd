// SPDX-License-Identifier: Apache-2.0
// A port in front of a port: keeps the last exchange as it was on the line, and ends what takes too long.
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

/// A request and all that came behind it, up to the next one.
template <class Item>
struct LineExchange {
  std::vector<Item> request{};
  std::vector<Item> received{};  // the adapter's echo included
  std::size_t echo = 0;          // so many items of `received` are that echo
  std::size_t clocks = 0;        // of a clocked link, which sends nothing else
  Time answer{};                 // how long the protocol waits for the beginning of a reply; 0: it does not wait
  Time sent_at{};                // end of the request
  Time sent_late{};              // which may have been so much earlier
  Time received_at{};            // end of the last item
  /// When how many items of `received` were there.
  struct Mark {
    Time at{};
    std::size_t items = 0;
  };
  std::vector<Mark> marks{};

  [[nodiscard]] std::span<const Item> reply() const {
    return std::span<const Item>(received).subspan(std::min(echo, received.size()));
  }
  /// From the end of the request to the first character of the reply; `character`: the time of one, 0 for frames. 0
  /// without a reply.
  [[nodiscard]] Time answered_after(Time character) const {
    const auto first = std::find_if(marks.begin(), marks.end(), [this](const Mark& one) { return one.items > echo; });
    if (first == marks.end()) return {};
    return first->at - sent_at - character * static_cast<std::int64_t>(first->items - echo);
  }
  /// Forgets all, and keeps the memory.
  void clear() {
    request.clear();
    received.clear();
    marks.clear();
    echo = clocks = 0;
    answer = sent_at = sent_late = received_at = {};
  }
};

/// Thrown by a wait that reached the deadline.
struct OutOfTime {};

/// Lets a conversation that first has to leave the encoder as it was do so when Ctrl-C comes.
template <class Item>
class WatchedPort final : public Port<Item> {
 public:
  /// The port to use from now on.
  void attach(Port<Item>& port) {
    port_ = &port;
    rate_ = 0;
  }
  /// Before a conversation: one that was broken off may have left the port at another rate than that of its encoder.
  void return_to(std::uint32_t rate) {
    if (rate_ != 0 && rate_ != rate) begin({.kind = Step<Item>::Kind::configure, .rate = rate});
  }

  Time now() override { return looked_at_ = port_->now(); }

  void begin(const Step<Item>& step) override {
    using Kind = typename Step<Item>::Kind;
    if (step.kind == Kind::transfer || step.kind == Kind::pulse) {
      last.clear();
      last.request.assign(step.out.begin(), step.out.end());
      last.clocks = step.bits;
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

  /// Whether the conversation was asked to end early since this was asked last.
  [[nodiscard]] bool take_aborted() { return std::exchange(aborted_, false); }

  std::function<bool()> over;   // ends all waiting; may throw os::Interrupted, which asks the conversation to end
  std::function<bool()> abort;  // asks the conversation to end early; returns whether it ends by itself
  Time deadline = never;        // by the port's clock: a wait that reaches it throws OutOfTime
  LineExchange<Item> last;
  Time nothing_until{};  // when a wait ended last with nothing on the line
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
  // The clock is not looked at between a step and its wait: the time of the step could pass then.
  [[nodiscard]] Step<Item> bounded(const Step<Item>& step) const {
    if (deadline == never) return step;
    if (deadline <= looked_at_) throw OutOfTime{};
    Step<Item> sooner = step;
    sooner.at = std::min(step.at > looked_at_ ? step.at : never, deadline);
    return sooner;
  }

  static constexpr std::size_t most_kept = 1024;
  Port<Item>* port_ = nullptr;
  Time looked_at_{};        // what the clock said last
  std::uint32_t rate_ = 0;  // to which a conversation brought the port; 0: none did
  bool aborted_ = false;
};

}  // namespace absenc::client
