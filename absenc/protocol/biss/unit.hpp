// SPDX-License-Identifier: Apache-2.0
// The BiSS-C protocols as units.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::biss {

extern const Unit unit;  ///< The unit.
/// A control position word and a safety position word in one frame.
extern const Unit safety_unit;
/// Several encoders in one frame.
extern const Unit chain_unit;

}  // namespace absenc::biss
