// SPDX-License-Identifier: Apache-2.0
// Files with secrets, which only their owner may read.
#pragma once

#include <string>

namespace absenc::os {

/// Returns the command that denies others the access to the file at `path`, as "chmod 600 FILE"; "" if others can
/// neither read nor write it, or if there is no such file.
[[nodiscard]] std::string command_to_deny_others(const std::string& path);

}  // namespace absenc::os
