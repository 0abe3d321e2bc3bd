// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace absenc::serve {

/// Returns the path of a file that a service stores: in $STATE_DIRECTORY, which systemd sets, else in the user's state
/// folder ($XDG_STATE_HOME/absenc or ~/.local/state/absenc). Creates the folder if it is missing. `option` is the
/// command-line option or setting for another path, which the error names. Throws UsageError, Failure.
[[nodiscard]] std::string state_file(std::string_view name, std::string_view option);

}  // namespace absenc::serve
