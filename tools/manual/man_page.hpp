// SPDX-License-Identifier: Apache-2.0
// The man page of the command, made from the same data as its help.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "absenc/protocol/unit.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// roff for the man macros.
[[nodiscard]] std::string man_page(std::string_view version, std::span<const Subcommand* const> subcommands,
                                   std::span<const Unit* const> units);

/// Text as roff shows it unchanged; what stands between backquotes is bold.
[[nodiscard]] std::string to_roff(std::string_view text);

}  // namespace absenc::tool
