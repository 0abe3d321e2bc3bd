// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace absenc::serve {

/// Where a file stands that a service keeps, in $STATE_DIRECTORY, which systemd gives to it, or else in the user's
/// folder for what programs keep, which is made. `option` would name it otherwise. Throws UsageError, Failure.
[[nodiscard]] std::string state_file(std::string_view name, std::string_view option);

}  // namespace absenc::serve
