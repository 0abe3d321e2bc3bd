// SPDX-License-Identifier: Apache-2.0
// The T-format as the neutral layers see it.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::tformat {

extern constinit const Unit unit;  ///< The unit.

}  // namespace absenc::tformat
