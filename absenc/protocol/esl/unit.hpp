// SPDX-License-Identifier: Apache-2.0
// The protocol unit of ESL (QS35), for the layers that know no protocol.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::esl {

extern constinit const Unit unit;   ///< Descriptor of ESL.
extern const Clauses unit_clauses;  ///< The demands of the protocol's document.

}  // namespace absenc::esl
