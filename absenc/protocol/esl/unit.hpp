// SPDX-License-Identifier: Apache-2.0
// The protocol unit of ESL (QS35), for the layers that know no protocol.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::esl {

extern constinit const Unit unit;   ///< Protocol unit of ESL.
extern const Clauses unit_clauses;  ///< The clauses of the ESL document, for conformance tests of encoders and hosts.

}  // namespace absenc::esl
