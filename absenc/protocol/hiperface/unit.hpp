// SPDX-License-Identifier: Apache-2.0
// SICK's HIPERFACE parameter channel as a unit for the list of units.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::hiperface {

extern const Unit unit;             ///< The protocol as a unit, for the list of units.
extern const Clauses unit_clauses;  ///< The demands of the protocol's document.

}  // namespace absenc::hiperface
