// SPDX-License-Identifier: Apache-2.0
// Runs conversations on a simulated line behind the ReplyGuard, as a session does.
#pragma once

#include <cstdint>
#include <span>

#include "absenc/host/reply_guard.hpp"
#include "absenc/sim/faults.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::host::testing {

template <class Item>
class GuardedHost {
 public:
  GuardedHost(const Unit& unit, sim::Line<Item>& line, std::span<const OptionText> options = {})
      : unit_(&unit), line_(&line) {
    valid_ = resolve_options(unit, {}, options, options_).kind == OptionError::Kind::none;
  }

  /// Runs `conversation`; returns whether it ended within `limit`. A conversation that sends a request for each result
  /// of a stream is stopped at its first result, which counts as its end.
  [[nodiscard]] bool run(Conversation<Item>& conversation, Time limit, bool may_repeat = true) {
    streams_ = conversation.asks();
    emitted_ = false;
    guard_.attach(conversation, *unit_, options_, may_repeat);
    if (node_ == none) {
      node_ = line_->attach(sim::NodeRole::host, guard_, [this] {
        emitted_ = streams_;
        return !streams_;
      });
    } else {
      line_->replace(node_, guard_);
    }
    const bool ended = line_->run(node_, line_->now() + limit) || emitted_;
    guard_.conclude();
    return valid_ && ended;
  }

 private:
  static constexpr std::size_t none = ~std::size_t{0};
  const Unit* unit_;
  sim::Line<Item>* line_;
  Options options_;
  bool valid_ = false;
  ReplyGuard<Item> guard_;
  std::size_t node_ = none;
  bool streams_ = false;
  bool emitted_ = false;
};

/// Returns the number of injected faults of all kinds that change bytes.
[[nodiscard]] inline std::uint64_t changed_bytes(const sim::FaultyDevice& faulty) {
  using sim::FaultKind;
  std::uint64_t sum = 0;
  for (const FaultKind kind :
       {FaultKind::drop, FaultKind::corrupt, FaultKind::truncate, FaultKind::garbage, FaultKind::request_corrupt}) {
    sum += faulty.count(kind);
  }
  return sum;
}

}  // namespace absenc::host::testing
