// SPDX-License-Identifier: Apache-2.0
// A measured value with its uncertainty, as people write it.
#pragma once

#include <string>
#include <string_view>

namespace absenc::client {

/// A measured value with its uncertainty.
struct Estimate {
  double value = 0;        ///< The estimated value.
  double uncertainty = 0;  ///< Greatest distance of the true value from `value`.
};

/// Returns "12.0 ± 0.3", with as many digits as the uncertainty justifies, at most four decimals. The uncertainty is
/// rounded up and covers the rounding of the value. `sign` separates the two.
[[nodiscard]] std::string to_text(const Estimate& estimate, std::string_view sign = "±");
/// Returns the value without its uncertainty: "12.0".
[[nodiscard]] std::string value_text(const Estimate& estimate);

}  // namespace absenc::client
