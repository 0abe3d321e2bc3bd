// SPDX-License-Identifier: Apache-2.0
// The protocol unit of the T-format, for the layers that know no protocol.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::tformat {

extern constinit const Unit unit;   ///< Descriptor of the T-format.
extern const Clauses unit_clauses;  ///< Demands of the T-format's document on encoder and host.

}  // namespace absenc::tformat
