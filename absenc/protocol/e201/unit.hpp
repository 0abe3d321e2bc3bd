// SPDX-License-Identifier: Apache-2.0
// The E201-9S as a unit for the list of units.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::e201 {

extern const Unit unit;             ///< The protocol as a unit, for the list of units.
extern const Clauses unit_clauses;  ///< The demands of its document.

}  // namespace absenc::e201
