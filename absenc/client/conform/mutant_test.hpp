// SPDX-License-Identifier: Apache-2.0
// A virtual encoder whose requests and replies a test can change.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absenc/client/conform/asked_test.hpp"
#include "absenc/client/conform/conform_link.hpp"
#include "absenc/client/port/virtual_link_test.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::client {

template <class Item>
class Mutant final : public Machine<Item> {
 public:
  using Kind = typename Event<Item>::Kind;

  explicit Mutant(Machine<Item>& device, LinkKind link) : driven(host_clocks(link)), device_(device) {}

  void feed(const Event<Item>& event) override {
    Event<Item> changed = event;
    if (event.kind == Kind::selected || event.kind == Kind::triggered) ++requests;
    if (event.kind == Kind::line_error) {
      note_special({});
      if (is_special && on_damage) {
        last_request_ = good;
        changed = {.kind = Kind::received, .at = event.at, .items = last_request_};
      }
    } else if (event.kind == Kind::received) {
      if (!driven) ++requests;
      last_request_.assign(event.items.begin(), event.items.end());
      if (good.empty()) good = last_request_;
      note_special(last_request_);
      if (change_request) change_request(last_request_);
      changed.items = last_request_;
      if (last_request_.empty()) return;
    }
    device_.feed(changed);
  }

  Step<Item> next(Time now) override {
    for (;;) {
      Step<Item> step = device_.next(now);
      if (step.kind != Step<Item>::Kind::transfer) return step;
      reply_items.assign(step.out.begin(), step.out.end());
      if (!driven && last_request_.empty()) ++requests;  // an unsolicited frame of the device counts as a request
      if (change_reply && mutates()) {
        change_reply(reply_items, step);
        if (reply_items.empty() && driven) continue;
        // Tells the device that its reply was sent, although the mutant has suppressed the reply.
        if (reply_items.empty()) {
          device_.feed({.kind = Kind::sent, .at = now});
          continue;
        }
      }
      step.out = reply_items;
      return step;
    }
  }

  [[nodiscard]] std::span<const Item> last_request() const { return last_request_; }

  std::function<void(std::vector<Item>&)> change_request{};
  std::function<void(std::vector<Item>&, Step<Item>&)> change_reply{};
  // whether a special request (`is_special`) that was damaged on the line reaches the encoder as the good request
  // `good`
  bool on_damage = false;
  // whether the mutant changes the replies to special requests (`is_special`), instead of the reply to the request with
  // the number `mutated`
  bool changes_special = false;
  bool always = false;  // whether the replies to all requests from number `mutated` on are changed
  // number of the first request, from 1, whose reply is changed
  unsigned mutated = 3;
  bool driven = false;
  unsigned requests = 0;
  std::vector<Item> reply_items;
  std::vector<Item> good;  // the first request that was received, which is a good one
  // index in `specials_`, the list of requests other than `good`, of the only request that counts as special; -1: each
  // of them counts
  int special = -1;
  // further condition that a request must meet to count as special; empty: there is none
  std::function<bool(const std::vector<Item>&)> is_meant{};
  // whether the last request is a special one, whose reply may be changed: it differs from `good`, and `special` and
  // `is_meant` select it
  bool is_special = false;

 private:
  // Sets whether the request is special. For a request that the line has damaged, `request` is empty.
  void note_special(const std::vector<Item>& request) {
    is_special = false;
    if (!request.empty() && request == good) return;
    const auto found = std::find(specials_.begin(), specials_.end(), request);
    const auto index = found - specials_.begin();
    if (found == specials_.end()) specials_.push_back(request);
    is_special = (special < 0 || special == index) && (!is_meant || is_meant(request));
  }
  [[nodiscard]] bool mutates() const {
    if (changes_special) return is_special;
    return requests == mutated || (always && requests > mutated);
  }

  Machine<Item>& device_;
  std::vector<Item> last_request_;
  std::vector<std::vector<Item>> specials_;
};

/// A defect of an encoder: a change of the mutant, or a condition of the virtual encoder.
template <class Item>
struct ReplyChange {
  std::function<void(Mutant<Item>&)> change{};
  std::string condition{};
};

template <class Item>
Machine<Item>& machine_of(const VirtualDevice& device) {
  if constexpr (std::is_same_v<Item, CanFrame>) {
    return *device.frames();
  } else {
    return *device.bytes();
  }
}

template <class Item>
Conformance conform_mutant(EncoderAddress address, const ReplyChange<Item>& change, const ConformChoices& choices,
                           Time latency = {}) {
  if (!change.condition.empty()) address.device.conditions.push_back(change.condition);
  Link link;
  link.latency = latency;
  link.device = std::make_unique<VirtualDevice>(*address.unit, address.options, address.device);
  link.device->power_on(Time{});
  Mutant<Item> mutant(machine_of<Item>(*link.device), address.unit->link);
  if (change.change) change.change(mutant);
  put_on_line(link, address, mutant, {.rough = sim::RoughRates{}});
  return conform(address, std::move(link), choices, "NAME");
}

inline std::vector<std::string> with_verdict(const Conformance& conformance, Verdict verdict) {
  std::vector<std::string> ids;
  for (const ClauseResult& one : conformance.clauses) {
    if (one.verdict == verdict) ids.emplace_back(one.id);
  }
  return ids;
}
inline Verdict verdict_of(const Conformance& conformance, std::string_view id) {
  for (const ClauseResult& one : conformance.clauses) {
    if (one.id == id) return one.verdict;
  }
  return Verdict::untested;
}

inline std::string address_showing(const Unit& unit, const Clause& clause) {
  return fmt::format("sim:{}{}{}", unit.id, clause.shown_with.empty() ? "" : "?", clause.shown_with);
}

}  // namespace absenc::client
