// SPDX-License-Identifier: Apache-2.0
// The protocol unit of Nikon's A-format, for the layers that know no protocol.
#pragma once

#include "absenc/protocol/clause.hpp"

/// Nikon's A-format: one to eight encoders on an RS-485 line.
namespace absenc::nikon {

extern constinit const Unit unit;   ///< Descriptor of the A-format.
extern const Clauses unit_clauses;  ///< Demands of the A-format's sources on encoder and host.

}  // namespace absenc::nikon
