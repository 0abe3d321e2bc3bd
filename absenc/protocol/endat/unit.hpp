// SPDX-License-Identifier: Apache-2.0
// The protocol unit of EnDat, for the layers that know no protocol.
#pragma once

#include "absenc/protocol/clause.hpp"

/// Protocol unit of HEIDENHAIN's EnDat 2.1 and 2.2.
namespace absenc::endat {

extern constinit const Unit unit;  ///< Protocol unit of EnDat.
/// Clauses of EnDat's sources for encoders and hosts, for conformance tests.
extern const Clauses unit_clauses;

}  // namespace absenc::endat
