// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace absenc::os {

/// Appends `line`, which must include its line end, to the file at `path` with a single write, so that lines of several
/// processes stay intact. Creates missing folders, and a missing file, which only this user can access. If the last
/// line of the file is incomplete, as after a full disk, ends it first. Returns 0 or a value of errno.
[[nodiscard]] int append_line(const std::string& path, std::string_view line);

}  // namespace absenc::os
