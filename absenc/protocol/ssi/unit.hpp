// SPDX-License-Identifier: Apache-2.0
// SSI as a unit for the list of units.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::ssi {

extern const Unit unit;             ///< SSI as a unit, for the list of units.
extern const Clauses unit_clauses;  ///< The document's demands on SSI encoders and hosts, for conformance tests.

}  // namespace absenc::ssi
