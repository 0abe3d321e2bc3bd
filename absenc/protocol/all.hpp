// SPDX-License-Identifier: Apache-2.0
// The list of all protocol units.
#pragma once

#include <span>
#include <string_view>

#include "absenc/protocol/unit.hpp"

namespace absenc {

/// Returns all protocol units, in the order of `protocol/all.cpp`.
[[nodiscard]] std::span<const Unit* const> all_units();

/// Returns the protocol unit with the identifier `id`, or null if there is none.
[[nodiscard]] const Unit* find_unit(std::string_view id);

}  // namespace absenc
