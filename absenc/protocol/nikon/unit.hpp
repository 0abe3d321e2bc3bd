// SPDX-License-Identifier: Apache-2.0
// The protocol unit of Nikon's A-format, for the layers that know no protocol.
#pragma once

#include "absenc/protocol/clause.hpp"

/// Protocol unit of Nikon's A-format: one to eight encoders on an RS-485 line.
namespace absenc::nikon {

extern constinit const Unit unit;  ///< Protocol unit of the A-format.
/// Clauses of the A-format's sources for encoders and hosts, for conformance tests.
extern const Clauses unit_clauses;

}  // namespace absenc::nikon
