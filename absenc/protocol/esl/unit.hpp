// SPDX-License-Identifier: Apache-2.0
// The unit of ESL, for the neutral layers.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::esl {

extern constinit const Unit unit;  ///< The unit.

}  // namespace absenc::esl
