// SPDX-License-Identifier: Apache-2.0
// Makes the bash completion of the command from the data of its help.
#pragma once

#include <span>
#include <string>

#include "absenc/protocol/unit.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// Returns a script for bash 4 or later, independent of the package bash-completion.
[[nodiscard]] std::string bash_completion(std::span<const Subcommand* const> subcommands,
                                          std::span<const Unit* const> units);

}  // namespace absenc::tool
