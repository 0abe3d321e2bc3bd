// SPDX-License-Identifier: Apache-2.0
// Probabilities that chance explains an observation.
#pragma once

#include <cmath>
#include <cstddef>

namespace absenc::client {

/// Returns the logarithm of the number of path_faults to choose `some` of `all`.
[[nodiscard]] inline double log_choose(std::size_t all, std::size_t some) {
  return std::lgamma(static_cast<double>(all + 1)) - std::lgamma(static_cast<double>(some + 1)) -
         std::lgamma(static_cast<double>(all - some + 1));
}

/// Returns the probability that an event of probability `share` (above 0 and below 1) occurs in `some` or more of `all`
/// trials.
[[nodiscard]] inline double chance_of(std::size_t some, std::size_t all, double share) {
  double sum = 0;
  for (std::size_t more = some; more <= all; ++more) {
    sum += std::exp(log_choose(all, more) + static_cast<double>(more) * std::log(share) +
                    static_cast<double>(all - more) * std::log1p(-share));
  }
  return sum;
}

}  // namespace absenc::client
