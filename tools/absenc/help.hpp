// SPDX-License-Identifier: Apache-2.0
// Help text, made from the same data as the command line.
#pragma once

#include <string>

#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// Of the whole command.
[[nodiscard]] std::string help();
[[nodiscard]] std::string help(const Subcommand& subcommand);

/// "absenc read <encoder> [options]"
[[nodiscard]] std::string usage(const Subcommand& subcommand);

}  // namespace absenc::tool
