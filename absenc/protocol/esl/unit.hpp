// SPDX-License-Identifier: Apache-2.0
// ESL as the neutral layers see it.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::esl {

extern constinit const Unit unit;  ///< The unit.

}  // namespace absenc::esl
