// SPDX-License-Identifier: Apache-2.0
// SSI as a unit for the list of units.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::ssi {

extern const Unit unit;  ///< The protocol as a unit, for the list of units.

}  // namespace absenc::ssi
