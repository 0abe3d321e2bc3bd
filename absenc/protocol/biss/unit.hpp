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
extern const Clauses unit_clauses;  ///< The document's demands on encoders and hosts of BiSS-C, for conformance tests.
/// The document's demands on encoders and hosts of BiSS Safety, for conformance tests.
extern const Clauses safety_unit_clauses;
/// The document's demands on encoders and hosts of chains, for conformance tests.
extern const Clauses chain_unit_clauses;

}  // namespace absenc::biss
