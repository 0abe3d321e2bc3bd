// SPDX-License-Identifier: Apache-2.0
// Measures how often a unit's frame check accepts damaged replies, and judges whether a host accepted more.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "absenc/sim/faulty_node.hpp"
#include "tests/kit/findings.hpp"
#include "tests/kit/frames.hpp"

namespace absenc::kit {

/// Number of damaged replies, and how many of these were accepted and decoded to a wrong value.
struct DamageCount {
  std::uint64_t damaged = 1;
  std::uint64_t wrong = 0;

  [[nodiscard]] double chance() const { return static_cast<double>(wrong) / static_cast<double>(damaged); }

  /// Returns how many of `trials` further damaged replies may be decoded to a wrong value, if the probability is the
  /// measured one.
  [[nodiscard]] std::uint64_t allowed(std::uint64_t trials) const {
    const double ratio = static_cast<double>(trials) / static_cast<double>(damaged);
    const double deviation = std::sqrt(static_cast<double>(wrong) * ratio * (1 + ratio));
    return static_cast<std::uint64_t>(static_cast<double>(wrong) * ratio + 5 * deviation + 10 * std::max(1.0, ratio));
  }
};

/// Counts of undetected damage: of replies with a wrong position, and of replies in which only other fields are
/// wrong.
struct UndetectedDamage {
  DamageCount position{};
  DamageCount others{};

  /// Replaces each count by that of `other` if a greater share of the damaged replies of `other` was undetected.
  void add(const UndetectedDamage& other) {
    if (other.position.chance() >= position.chance()) position = other.position;
    if (other.others.chance() >= others.chance()) others = other.others;
  }
};

/// Counts the damaged replies to one command, and the wrong results that a host made of them.
struct DamagedReplies {
  /// measured numbers of damaged replies that the frame check accepts; empty if not measured yet
  std::optional<UndetectedDamage> undetected{};
  std::uint64_t count = 0;            ///< number of damaged replies
  std::uint64_t wrong_positions = 0;  ///< number of wrong results with a wrong position
  std::uint64_t wrong_values = 0;     ///< number of wrong results with a right position and another wrong value
  std::string example{};              ///< the first wrong result, in words

  /// Adds a finding if there are more wrong results than the frame check lets pass, and a note if there is any.
  /// `command` names the command.
  void judge(const std::string& command, Findings& findings) const;
};

/// Damages copies of `reply`, `samples` times in all, and counts those that decode to wrong values.
[[nodiscard]] UndetectedDamage measure_undetected_damage(const Unit& unit, const Options& options,
                                                         const OwnedFrame& request, const OwnedFrame& reply,
                                                         const sim::FaultRates& rates, unsigned samples);

}  // namespace absenc::kit
