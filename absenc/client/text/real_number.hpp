// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

namespace absenc::client {

/// Returns the number that the whole text is, as "12.5" or "1e-3"; nothing where it is none, is not finite, or is too
/// large or too small for a double.
[[nodiscard]] std::optional<double> parse_real(std::string_view text);

}  // namespace absenc::client
