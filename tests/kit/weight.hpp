// SPDX-License-Identifier: Apache-2.0
// What a unit's check is worth against the faults of a campaign, measured on its own frames: how many damaged replies
// look good and say something else.
#pragma once

#include <cmath>
#include <cstdint>

#include "absenc/sim/faulty_node.hpp"
#include "tests/kit/frames.hpp"

namespace absenc::kit {

/// Damaged replies, and how many of them a careful host would take for what they are not.
struct Weight {
  std::uint64_t damaged = 0;
  std::uint64_t wrong = 0;

  /// How many of `trials` damaged replies may be taken. Both numbers come from the same chance p, so that of all wrong
  /// ones a share of trials / (trials + damaged) is expected; five standard deviations and ten more are exceeded by
  /// chance in less than one of a million campaigns.
  [[nodiscard]] std::uint64_t allowed(std::uint64_t trials) const {
    const double ratio = static_cast<double>(trials) / static_cast<double>(damaged == 0 ? 1 : damaged);
    const double expected = static_cast<double>(wrong) * ratio;
    const double deviation = std::sqrt(static_cast<double>(wrong) * ratio * (1 + ratio));
    return static_cast<std::uint64_t>(expected + 5 * deviation + 10 * std::max(1.0, ratio));
  }
};

/// `samples` replies through the same faults as in a campaign. Of what comes, a host may take what it begins with, or
/// where frames come by themselves what stands anywhere in it.
[[nodiscard]] Weight weight_of(const Unit& unit, const Options& options, const Held& request, const Held& reply,
                               const sim::FaultRates& rates, unsigned samples);

}  // namespace absenc::kit
