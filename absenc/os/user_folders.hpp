// SPDX-License-Identifier: Apache-2.0
// The folders of this user for the files of absenc.
#pragma once

#include <string>

namespace absenc::os {

/// Returns the value of an environment variable; "" if it is not set.
[[nodiscard]] std::string environment(const char* name);

/// Returns the folder of settings that belong to absenc, "/home/joe/.config/absenc"; "" if the user has none.
[[nodiscard]] std::string settings_folder();

/// Returns the folder of what absenc writes by itself, "/home/joe/.local/state/absenc"; "" if the user has none.
[[nodiscard]] std::string state_folder();

}  // namespace absenc::os
