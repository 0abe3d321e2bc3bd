// SPDX-License-Identifier: Apache-2.0
// Stands in front of a conversation with somebody unknown: keeps every exchange, lets only harmless requests pass, and
// ends what takes too long.
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
};

struct ConversationLimits {
  Time quiet{};     // without a single item
  Time nonsense{};  // without a good reply
  Time deadline{};  // of all
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
    if (event.kind == Event<Item>::Kind::received) {
      heard += event.items.size();
      if (!exchanges.empty()) add(exchanges.back().reply, event.items);
    }
    inner_->feed(event);
  }

  /// Throws Stop.
  Step<Item> next(Time now) override {
    using Kind = typename Step<Item>::Kind;
    if (begun_ == Time{}) begun_ = now;
    if (now >= limits_.deadline) throw Stop::out_of_time;
    const Step<Item> step = inner_->next(now);
    if (step.kind == Kind::pulse && step.wire == ExtraWire::clear) throw Stop::harmful;
    if (!good_ && now - begun_ >= (heard == 0 ? limits_.quiet : limits_.nonsense)) {
      good_ = !exchanges.empty() && is_good_(exchanges.back());
      if (!good_) throw Stop::silent;
    }
    if (step.kind != Kind::transfer) return step;
    if (!good_) good_ = !exchanges.empty() && is_good_(exchanges.back());
    for (const std::vector<Item>& one : harmful_) {
      if (step.out.size() >= one.size() && std::equal(one.begin(), one.end(), step.out.begin())) throw Stop::harmful;
    }
    exchanges.push_back({.reply = {.bits = step.bits}});
    add(exchanges.back().request, step.out);
    return step;
  }

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

  Machine<Item>* inner_;
  std::span<const std::vector<Item>> harmful_;
  ConversationLimits limits_;
  std::function<bool(const capture::HeardExchange&)> is_good_;
  bool good_ = false;
  Time begun_{};
};

}  // namespace absenc::client
