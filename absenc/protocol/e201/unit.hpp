// SPDX-License-Identifier: Apache-2.0
// The E201-9S as a unit for the list of units.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::e201 {

extern const Unit unit;             ///< Descriptor of the E201-9S.
extern const Clauses unit_clauses;  ///< Demands of the E201-9S' document on interface and host.

}  // namespace absenc::e201
