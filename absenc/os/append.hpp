// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace absenc::os {

/// Appends `line`, which ends with a line feed, to the file at `path` in one write; creates a missing file. Returns 0
/// or a value of errno.
[[nodiscard]] int append_line(const std::string& path, std::string_view line);

}  // namespace absenc::os
