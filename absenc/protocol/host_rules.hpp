// SPDX-License-Identifier: Apache-2.0
// Counts the breaches of the rules that the host of a virtual encoder must keep, stores the first ones, and notifies an
// observer of each check.
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
  /// Records that the host did at `at` what `rule` is about. `kept`: whether it kept the rule; false is stored as a
  /// breach. Returns `kept`.
  bool expect(bool kept, std::string_view rule, Time at);

  /// Notifies only the observer: breaking this rule is no violation, because the document permits a host to do so, or
  /// the host may have given up after an error.
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
