// SPDX-License-Identifier: Apache-2.0
// Long names in little room: what tells them apart is not what is cut.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace absenc::tool {

/// Each name in at most `width` (8 or more) bytes, in the same order; ".." stands for what was left out of a longer
/// one. Names that differ also do so afterwards.
[[nodiscard]] std::vector<std::string> short_names(std::span<const std::string> names, std::size_t width);

}  // namespace absenc::tool
