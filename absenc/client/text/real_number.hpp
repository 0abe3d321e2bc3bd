// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

namespace absenc::client {

/// Parses the whole text as a number such as "12.5" or "1e-3". Returns nothing if the text is no number, or if the
/// number is not finite or out of a double's range.
[[nodiscard]] std::optional<double> parse_real(std::string_view text);

}  // namespace absenc::client
