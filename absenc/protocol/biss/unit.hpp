// SPDX-License-Identifier: Apache-2.0
// The three BiSS-C protocols as units for the list of units.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::biss {

extern const Unit unit;  ///< BiSS-C with one encoder and one position word.
/// BiSS Safety: a control position word and a safety position word in one frame.
extern const Unit safety_unit;
/// BiSS-C with several encoders in a chain.
extern const Unit chain_unit;
extern const Clauses unit_clauses;         ///< The demands on BiSS-C.
extern const Clauses safety_unit_clauses;  ///< The demands on BiSS Safety.
extern const Clauses chain_unit_clauses;   ///< The demands on a chain.

}  // namespace absenc::biss
