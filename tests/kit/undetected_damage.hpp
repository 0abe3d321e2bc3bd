// SPDX-License-Identifier: Apache-2.0
// Measures how often a unit's frame check accepts damaged replies. The replies pass through the same faults as in a
// campaign.
#pragma once

#include <cmath>
#include <cstdint>

#include "absenc/sim/faulty_node.hpp"
#include "tests/kit/frames.hpp"

namespace absenc::kit {

/// Number of damaged replies, and of those that decoded to a wrong value.
struct DamageCount {
  std::uint64_t damaged = 1;
  std::uint64_t wrong = 0;

  [[nodiscard]] double chance() const { return static_cast<double>(wrong) / static_cast<double>(damaged); }

  /// Returns how many of `trials` damaged replies may be accepted. Both counts come from the same probability p, so a
  /// share of trials / (trials + damaged) of all wrong ones is expected. Five standard deviations and ten more are
  /// exceeded by chance in less than one of a million campaigns.
  [[nodiscard]] std::uint64_t allowed(std::uint64_t trials) const {
    const double ratio = static_cast<double>(trials) / static_cast<double>(damaged);
    const double deviation = std::sqrt(static_cast<double>(wrong) * ratio * (1 + ratio));
    return static_cast<std::uint64_t>(static_cast<double>(wrong) * ratio + 5 * deviation + 10 * std::max(1.0, ratio));
  }
};

/// Rates of undetected damage: replies with another position, and replies with another value in any other field.
struct UndetectedDamage {
  DamageCount position{};
  DamageCount others{};

  /// Combines two measurements by the worse rate of each kind.
  void add(const UndetectedDamage& other) {
    if (other.position.chance() >= position.chance()) position = other.position;
    if (other.others.chance() >= others.chance()) others = other.others;
  }
};

/// Measures the rates with `samples` replies. A host may accept any prefix of the damaged bytes; where frames are sent
/// unsolicited, any part of them.
[[nodiscard]] UndetectedDamage measure_undetected_damage(const Unit& unit, const Options& options,
                                                         const OwnedFrame& request, const OwnedFrame& reply,
                                                         const sim::FaultRates& rates, unsigned samples);

}  // namespace absenc::kit
