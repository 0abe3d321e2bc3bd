// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace absenc::os {

/// Appends `line` to the file at `path`; the line, which includes its line end, in one write, so that lines of several
/// processes stay intact. Creates the file and its folders, accessible for this user only. If the last line is
/// incomplete, as after a full disk, it is ended first. Returns 0 or a value of errno.
[[nodiscard]] int append_line(const std::string& path, std::string_view line);

}  // namespace absenc::os
