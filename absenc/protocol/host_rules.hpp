// SPDX-License-Identifier: Apache-2.0
// Rules of the document that the host of a virtual encoder must keep: the violations, and a watch that is notified of
// each check.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc {

/// Rules that a virtual encoder watches, with those that the host broke.
class HostRules {
 public:
  /// Records that the host did what the rule is about. Returns `kept`.
  bool expect(bool kept, std::string_view rule, Time at);

  /// Notifies only the watch: breaking the rule is no violation, because a host may do so or may have given up.
  void note(bool kept, std::string_view rule) const;

  /// Returns the first rules that the host broke.
  [[nodiscard]] std::span<const Violation> violations() const { return violations_; }
  /// Returns how often the host broke a rule.
  [[nodiscard]] std::uint32_t violation_count() const { return count_; }
  /// Sets the watch of rule checks; null: none.
  void watch(RuleWatch* watch) { watch_ = watch; }

 private:
  Buffer<Violation, 16> violations_;
  std::uint32_t count_ = 0;
  RuleWatch* watch_ = nullptr;
};

}  // namespace absenc
