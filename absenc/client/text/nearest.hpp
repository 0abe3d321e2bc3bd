// SPDX-License-Identifier: Apache-2.0
// Suggests the name that the user most likely meant when a name is unknown.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace absenc::client {

/// Returns the name nearest to `written`; "" if none is near.
[[nodiscard]] std::string_view nearest(std::string_view written, std::span<const std::string_view> names);

/// Returns a hint for the user: "; did you mean X?" if a name is near to `written`, else "; known are: A, B, C"; "" if
/// there are no names.
[[nodiscard]] std::string suggestion(std::string_view written, std::span<const std::string_view> names);

}  // namespace absenc::client
