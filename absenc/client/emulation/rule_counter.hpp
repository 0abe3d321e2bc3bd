// SPDX-License-Identifier: Apache-2.0
// Counts how often each rule was checked, and how often it was broken.
#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include "absenc/client/emulate.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::client {

/// Returns the counter of this rule in `counts`; adds one if there is none.
[[nodiscard]] inline RuleCount& count_of(std::vector<RuleCount>& counts, std::string_view rule) {
  const auto found = std::ranges::find(counts, rule, &RuleCount::rule);
  return found != counts.end() ? *found : *counts.insert(found, {.rule = rule});
}

class RuleCounter final : public RuleWatch {
 public:
  void looked(std::string_view rule, bool kept) override {
    RuleCount& count = count_of(counts_, rule);
    ++count.looked;
    count.broken += kept ? 0 : 1;
  }
  [[nodiscard]] const std::vector<RuleCount>& counts() const { return counts_; }

 private:
  std::vector<RuleCount> counts_;
};

}  // namespace absenc::client
