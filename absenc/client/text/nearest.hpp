// SPDX-License-Identifier: Apache-2.0
// Suggests the name that the user most likely meant when a name is unknown.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace absenc::client {

/// Returns the name nearest to `written` by edit distance, in which upper and lower case are equal, and '_' and '-'
/// too. A name that begins with exactly `written`, if that has at least three letters, has the distance 1. Returns ""
/// if no name is near.
[[nodiscard]] std::string_view nearest(std::string_view written, std::span<const std::string_view> names);

/// Returns the end of an error message: "; did you mean X?" if a name is near, otherwise "; known are: A, B, C"; "" if
/// there are no names.
[[nodiscard]] std::string suggestion(std::string_view written, std::span<const std::string_view> names);

}  // namespace absenc::client
