// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace absenc::serve {

/// Returns the path of a service's file in $STATE_DIRECTORY or in the user's state folder, and creates that folder, not
/// the file. `option`: option or setting for another path, named in the error. Throws UsageError or Failure.
[[nodiscard]] std::string state_file(std::string_view name, std::string_view option);

}  // namespace absenc::serve
