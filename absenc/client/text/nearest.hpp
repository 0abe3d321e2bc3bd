// SPDX-License-Identifier: Apache-2.0
// Suggests the name that the user most likely meant when a name is unknown.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace absenc::client {

/// Returns the name nearest to `written`; "" if none is near.
[[nodiscard]] std::string_view nearest(std::string_view written, std::span<const std::string_view> names);

/// Returns "; did you mean X?" or "; known are: A, B, C" or "".
[[nodiscard]] std::string suggestion(std::string_view written, std::span<const std::string_view> names);

}  // namespace absenc::client
