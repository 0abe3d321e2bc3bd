// SPDX-License-Identifier: Apache-2.0
// What the user most likely meant by a name that does not exist.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace absenc::client {

/// The name nearest to `written` by edit distance, or "" when none is near. Upper and lower case are the same.
[[nodiscard]] std::string_view nearest(std::string_view written, std::span<const std::string_view> names);

/// "; did you mean X?" when one is near, otherwise "; known are: A, B, C", and nothing when there is no name.
[[nodiscard]] std::string suggestion(std::string_view written, std::span<const std::string_view> names);

}  // namespace absenc::client
