// SPDX-License-Identifier: Apache-2.0
// CUI Devices AMT21: RS-485, 12 or 14 bits, with or without turns.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::amt21 {

extern const Unit unit;

}  // namespace absenc::amt21
