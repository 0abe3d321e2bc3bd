// SPDX-License-Identifier: Apache-2.0
// The protocol unit of the T-format, for the layers that know no protocol.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::tformat {

extern constinit const Unit unit;   ///< Protocol unit of the T-format.
extern const Clauses unit_clauses;  ///< Clauses of the T-format document for encoders and hosts, for conformance tests.

}  // namespace absenc::tformat
