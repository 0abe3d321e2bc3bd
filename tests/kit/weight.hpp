// SPDX-License-Identifier: Apache-2.0
// What a unit's check is worth against the faults of a campaign, measured on its own frames: how many damaged replies
// look good and say something else.
#pragma once

#include <cmath>
#include <cstdint>

#include "absenc/sim/faulty_node.hpp"
#include "tests/kit/frames.hpp"

namespace absenc::kit {

/// Of so many damaged replies, how many looked good and were not.
struct Share {
  std::uint64_t damaged = 1;
  std::uint64_t wrong = 0;

  [[nodiscard]] double chance() const { return static_cast<double>(wrong) / static_cast<double>(damaged); }

  /// How many of `trials` damaged replies may be taken. Both numbers come from the same chance p, so that of all wrong
  /// ones a share of trials / (trials + damaged) is expected; five standard deviations and ten more are exceeded by
  /// chance in less than one of a million campaigns.
  [[nodiscard]] std::uint64_t allowed(std::uint64_t trials) const {
    const double ratio = static_cast<double>(trials) / static_cast<double>(damaged);
    const double deviation = std::sqrt(static_cast<double>(wrong) * ratio * (1 + ratio));
    return static_cast<std::uint64_t>(static_cast<double>(wrong) * ratio + 5 * deviation + 10 * std::max(1.0, ratio));
  }
};

/// What a careful host would take for what it is not: another position, and another value of anything else.
struct Weight {
  Share position{};
  Share others{};

  /// The worse of both.
  void add(const Weight& other) {
    if (other.position.chance() >= position.chance()) position = other.position;
    if (other.others.chance() >= others.chance()) others = other.others;
  }
};

/// `samples` replies through the same faults as in a campaign. Of what comes, a host may take what it begins with, or
/// where frames come by themselves what stands anywhere in it.
[[nodiscard]] Weight weight_of(const Unit& unit, const Options& options, const Held& request, const Held& reply,
                               const sim::FaultRates& rates, unsigned samples);

}  // namespace absenc::kit
