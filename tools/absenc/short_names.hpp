// SPDX-License-Identifier: Apache-2.0
// Shortens long names to fit a column and keeps the parts in which they differ.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace absenc::tool {

/// Returns each name in at most `width` (8 or more) bytes; different names remain different.
[[nodiscard]] std::vector<std::string> short_names(std::span<const std::string> names, std::size_t width);

}  // namespace absenc::tool
