// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/host_rules.hpp"

namespace absenc {

void HostRules::note(bool kept, std::string_view rule) const {
  if (watch_ != nullptr) watch_->looked(rule, kept);
}

bool HostRules::expect(bool kept, std::string_view rule, Time at) {
  note(kept, rule);
  if (kept) return true;
  violations_.push_back({rule, at});
  ++count_;
  return false;
}

}  // namespace absenc
