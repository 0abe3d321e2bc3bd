// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::protocol_name {

extern constinit const Unit unit;

}  // namespace absenc::protocol_name
