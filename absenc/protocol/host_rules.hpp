// SPDX-License-Identifier: Apache-2.0
// Counts the breaches of the rules that the host of a virtual encoder must keep.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc {

/// The rule breaches of a virtual encoder's host, and the observer of rule checks.
class HostRules {
 public:
  /// Records whether the host kept `rule` at the time `at`. Returns `kept`.
  bool expect(bool kept, std::string_view rule, Time at);

  /// Notifies only the observer whether the host kept `rule`; a breach is not counted as a violation.
  void note(bool kept, std::string_view rule) const;

  /// Returns the first 16 rule breaches of the host, in order of time.
  [[nodiscard]] std::span<const Violation> violations() const { return violations_; }
  /// Returns how often the host broke a rule.
  [[nodiscard]] std::uint32_t violation_count() const { return count_; }
  /// Sets the observer of rule checks; null: none.
  void watch(RuleWatch* watch) { watch_ = watch; }

 private:
  Buffer<Violation, 16> violations_;
  std::uint32_t count_ = 0;
  RuleWatch* watch_ = nullptr;
};

}  // namespace absenc
