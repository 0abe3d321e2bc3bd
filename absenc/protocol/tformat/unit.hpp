// SPDX-License-Identifier: Apache-2.0
// The unit of the T-format, for the neutral layers.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::tformat {

extern constinit const Unit unit;  ///< The unit.

}  // namespace absenc::tformat
