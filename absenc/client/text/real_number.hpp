// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

namespace absenc::client {

/// Parses the whole text as a finite number; nothing otherwise.
[[nodiscard]] std::optional<double> parse_real(std::string_view text);

}  // namespace absenc::client
