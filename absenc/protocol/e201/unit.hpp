// SPDX-License-Identifier: Apache-2.0
// The E201-9S as a unit for the list of units.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::e201 {

extern const Unit unit;  ///< The protocol as a unit, for the list of units.

}  // namespace absenc::e201
