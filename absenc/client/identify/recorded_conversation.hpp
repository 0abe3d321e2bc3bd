// SPDX-License-Identifier: Apache-2.0
// Stands in front of a conversation with somebody unknown: keeps every exchange, lets only harmless requests pass, ends
// what takes too long, and notices a reply that came after its time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "absenc/capture/search/evidence.hpp"
#include "absenc/link/step.hpp"

namespace absenc::client {

/// Why a conversation was broken off.
enum class Stop : std::uint8_t {
  silent,       // nobody answers, or nobody who makes sense
  out_of_time,  // of the whole search
  harmful,      // it was about to send what another encoder would take for a command
  late,         // a reply came when it was given up: what follows may be the answer to another request
};

/// Time in which nobody looked, because this process did not run, counts neither as quiet nor as nonsense.
struct ConversationLimits {
  Time quiet{};      // without a single item
  Time nonsense{};   // without a good reply
  Time deadline{};   // of all
  Time latency{};    // that the carrier adds to the limits of a step
  Time allowance{};  // more than that for an answer: replies have been late here
};

template <class Item>
class RecordedConversation final : public Machine<Item> {
 public:
  /// `harmful`: requests that would change an encoder of another protocol; whoever takes the first bytes of a longer
  /// request for one of them would obey.
  RecordedConversation(Machine<Item>& inner, std::span<const std::vector<Item>> harmful,
                       const ConversationLimits& limits, std::function<bool(const capture::HeardExchange&)> is_good)
      : inner_(&inner), harmful_(harmful), limits_(limits), is_good_(std::move(is_good)) {}

  void feed(const Event<Item>& event) override {
    using Kind = typename Event<Item>::Kind;
    if (event.at > due_) missed_ += event.at - due_;
    if (event.kind == Kind::received) {
      heard += event.items.size();
      if (!exchanges.empty()) add(exchanges.back().reply, event.items);
      if (given_up_) notice_late(event.at);
    }
    if (event.kind == Kind::silence && asked_ && is_unanswered()) given_up_ = true;
    if (event.kind == Kind::sent) {
      before_sent_at_ = std::exchange(sent_at_, event.at);
      given_up_ = false;
      asked_ = true;
    }
    if (event.kind == Kind::sent || event.kind == Kind::received) quiet_since_ = event.at;
    inner_->feed(event);
  }

  /// Throws Stop.
  Step<Item> next(Time now) override {
    using Kind = typename Step<Item>::Kind;
    if (begun_ == Time{}) begun_ = now;
    if (now >= limits_.deadline) throw Stop::out_of_time;
    Step<Item> step = inner_->next(now);
    if (step.kind == Kind::pulse && step.wire == ExtraWire::clear) throw Stop::harmful;
    if (!good_ && now - begun_ - missed_ >= (heard == 0 ? limits_.quiet : limits_.nonsense)) {
      good_ = !exchanges.empty() && is_good_(exchanges.back());
      if (!good_) throw Stop::silent;
    }
    if (step.kind == Kind::transfer || step.kind == Kind::done) judge_last(now);
    if (lateness_ != Time{}) throw Stop::late;
    if (step.answer != Time{}) step.answer += limits_.allowance;
    due_ = step.kind == Kind::wait ? due(step, now) : never;
    if (step.kind != Kind::transfer) return step;
    for (const std::vector<Item>& one : harmful_) {
      if (step.out.size() >= one.size() && std::equal(one.begin(), one.end(), step.out.begin())) throw Stop::harmful;
    }
    asked_ = false;
    exchanges.push_back({.reply = {.bits = step.bits}});
    add(exchanges.back().request, step.out);
    return step;
  }

  /// Stop::late: how long after its request the reply came.
  [[nodiscard]] Time lateness() const { return lateness_; }
  /// Whether the last request was not answered; its reply may still be under way.
  [[nodiscard]] bool is_unanswered() const { return !exchanges.empty() && exchanges.back().reply.frame().empty(); }
  /// When it had left.
  [[nodiscard]] Time sent_at() const { return sent_at_; }

  std::vector<capture::HeardExchange> exchanges;
  std::size_t heard = 0;  // items

 private:
  // Of CAN frames the last: what came before it was not for this conversation, which would have ended.
  static void add(capture::HeardFrame& frame, std::span<const Item> items) {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      if (!items.empty()) frame.can = items.back();
    } else {
      frame.bytes.insert(frame.bytes.end(), items.begin(), items.end());
    }
  }

  // When the carrier is to be back at the latest.
  [[nodiscard]] Time due(const Step<Item>& step, Time now) const {
    const Time limit = is_unanswered() ? step.answer : step.gap;
    const Time quiet_end = asked_ && limit != Time{} ? quiet_since_ + limit + limits_.latency : never;
    const Time latest = std::min(step.at > now ? step.at : never, quiet_end);
    return latest > now ? latest : never;
  }

  // The identifiers of CAN frames tell whose answer they are, and some come unasked.
  void notice_late(Time at) {
    if constexpr (!std::is_same_v<Item, CanFrame>) lateness_ = std::max(at - sent_at_, Time{1});
  }

  // What is no reply to its own request, but one to the request before, which was given up.
  void judge_last(Time now) {
    if (exchanges.empty()) return;
    const capture::HeardExchange& last = exchanges.back();
    const bool is_good = !last.reply.frame().empty() && is_good_(last);
    good_ = good_ || is_good;
    if (is_good || last.reply.frame().empty() || exchanges.size() < 2) return;
    const capture::HeardExchange& before = exchanges[exchanges.size() - 2];
    if (!before.reply.frame().empty() || before.request == last.request) return;
    if (!is_good_({.request = before.request, .reply = last.reply})) return;
    if constexpr (!std::is_same_v<Item, CanFrame>) lateness_ = std::max(now - before_sent_at_, Time{1});
  }

  Machine<Item>* inner_;
  std::span<const std::vector<Item>> harmful_;
  ConversationLimits limits_;
  std::function<bool(const capture::HeardExchange&)> is_good_;
  bool good_ = false;
  bool asked_ = false;     // the last request has left
  bool given_up_ = false;  // it was waited for its reply in vain
  Time begun_{};
  Time missed_{};  // between what was due and when it was looked at
  Time due_ = never;
  Time sent_at_{};
  Time before_sent_at_{};
  Time quiet_since_{};
  Time lateness_{};
};

}  // namespace absenc::client
