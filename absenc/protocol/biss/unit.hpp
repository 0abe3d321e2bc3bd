// SPDX-License-Identifier: Apache-2.0
// BiSS-C as the neutral layers see it.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::biss {

extern const Unit unit;

}  // namespace absenc::biss
