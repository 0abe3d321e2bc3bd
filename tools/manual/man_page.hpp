// SPDX-License-Identifier: Apache-2.0
// Makes the man page of the command from the data of its help.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "absenc/protocol/unit.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// Returns the man page of the command as roff source for the man macros.
[[nodiscard]] std::string man_page(std::string_view version, std::span<const Subcommand* const> subcommands,
                                   std::span<const Unit* const> units);

/// Returns `text` escaped for roff; text between backquotes becomes bold.
[[nodiscard]] std::string to_roff(std::string_view text);

}  // namespace absenc::tool
