// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/share.hpp"

#include <algorithm>
#include <cmath>

namespace absenc::client {

namespace {

// Returns one end of Wilson's confidence interval: the lower end for a `side` of -1, the upper end for 1.
double wilson(const Share& share, double side) {
  if (share.of == 0) return side > 0 ? 1 : 0;
  // a share of 0 has the lower end 0 exactly; the formula would return a rounding error
  if (share.count == 0 && side < 0) return 0;
  constexpr double z = 1.96;
  const auto n = static_cast<double>(share.of);
  const double p = share.rate();
  const double middle = p + z * z / (2 * n);
  const double half = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return std::clamp((middle + side * half) / (1 + z * z / n), 0.0, 1.0);
}

}  // namespace

double Share::low() const { return wilson(*this, -1); }
double Share::high() const { return wilson(*this, 1); }

}  // namespace absenc::client
