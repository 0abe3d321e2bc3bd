// SPDX-License-Identifier: Apache-2.0
// The completion of the command in bash, made from the same data as its help.
#pragma once

#include <span>
#include <string>

#include "absenc/protocol/unit.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// A script for bash 4 or later; it needs nothing of the package bash-completion.
[[nodiscard]] std::string bash_completion(std::span<const Subcommand* const> subcommands,
                                          std::span<const Unit* const> units);

}  // namespace absenc::tool
