// SPDX-License-Identifier: Apache-2.0
// Declares SICK's HIPERFACE parameter channel as a unit, for the list of units.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::hiperface {

extern const Unit unit;             ///< Protocol unit of the HIPERFACE parameter channel.
extern const Clauses unit_clauses;  ///< Clauses of HIPERFACE for encoders and hosts, for conformance tests.

}  // namespace absenc::hiperface
