// SPDX-License-Identifier: Apache-2.0
// A measured value with its uncertainty, and its text for people.
#pragma once

#include <string>
#include <string_view>

namespace absenc::client {

/// A measured value with its uncertainty.
struct Estimate {
  double value = 0;        ///< Estimate of the true value of what was measured.
  double uncertainty = 0;  ///< Greatest distance of the true value from `value`.
};

/// Returns value and uncertainty as text, "12.0 ± 0.3"; `sign` is the text between the numbers.
[[nodiscard]] std::string to_text(const Estimate& estimate, std::string_view sign = "±");
/// Returns the value alone as text, "12.0", with as many decimals as the uncertainty justifies, at most 4.
[[nodiscard]] std::string value_text(const Estimate& estimate);

}  // namespace absenc::client
