// SPDX-License-Identifier: Apache-2.0
// Counts how often a virtual encoder looked at each rule of its host.
#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include "absenc/client/emulate.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::client {

class RuleCounter final : public RuleWatch {
 public:
  void looked(std::string_view rule, bool kept) override {
    auto found = std::find_if(counts_.begin(), counts_.end(), [&](const RuleCount& one) { return one.rule == rule; });
    if (found == counts_.end()) found = counts_.insert(found, {.rule = rule});
    ++found->looked;
    found->broken += kept ? 0 : 1;
  }
  [[nodiscard]] const std::vector<RuleCount>& counts() const { return counts_; }

 private:
  std::vector<RuleCount> counts_;
};

}  // namespace absenc::client
