// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace absenc::os {

/// Appends `line`, which has its end, by one write, so that lines of several processes stay whole; makes the file and
/// its folders for this user alone. A cut last line, as a full disk leaves it, gets its end first. Returns 0, or the
/// error of the system.
[[nodiscard]] int append_line(const std::string& path, std::string_view line);

}  // namespace absenc::os
