// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/estimate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace absenc::client {

namespace {

int decimals(double uncertainty) {
  constexpr int most = 4;
  if (!(uncertainty > 0)) return most;
  return std::clamp(static_cast<int>(-std::floor(std::log10(uncertainty))), 0, most);
}

double rounded(double value, int decimals) {
  const double scale = std::pow(10, decimals);
  return std::round(value * scale) / scale + 0.0;  // the result -0.0 plus 0.0 is 0.0, so that no "-0.0" is printed
}

}  // namespace

std::string value_text(const Estimate& estimate) {
  const int behind = decimals(estimate.uncertainty);
  return fmt::format("{:.{}f}", rounded(estimate.value, behind), behind);
}

std::string to_text(const Estimate& estimate, std::string_view sign) {
  const int behind = decimals(estimate.uncertainty);
  const double scale = std::pow(10, behind);
  const double rounding = std::abs(rounded(estimate.value, behind) - estimate.value);
  const double uncertainty = std::ceil((estimate.uncertainty + rounding) * scale - 1e-6) / scale;
  return fmt::format("{} {} {:.{}f}", value_text(estimate), sign, uncertainty, behind);
}

}  // namespace absenc::client
