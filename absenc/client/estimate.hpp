// SPDX-License-Identifier: Apache-2.0
// A measured value with its uncertainty, as people write it.
#pragma once

#include <string>
#include <string_view>

namespace absenc::client {

/// A value, and how far the true one is from it at most.
struct Estimate {
  double value = 0;        ///< The estimated value.
  double uncertainty = 0;  ///< Greatest distance of the true value from `value`.
};

/// "12.0 ± 0.3": as many digits as the uncertainty leaves, at most four behind the point. The uncertainty is rounded up
/// and holds for the digits that are shown. `sign` stands between the two.
[[nodiscard]] std::string to_text(const Estimate& estimate, std::string_view sign = "±");
/// The first of the two: "12.0".
[[nodiscard]] std::string value_text(const Estimate& estimate);

}  // namespace absenc::client
