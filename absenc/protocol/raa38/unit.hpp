// SPDX-License-Identifier: Apache-2.0
// The RAA38S6 as units: one for each kind of line.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::raa38 {

extern constinit const Unit serial_unit;  ///< RS-485, RS-232, RS-422
extern constinit const Unit modbus_unit;  ///< The unit for Modbus RTU.
extern constinit const Unit can_unit;     ///< The unit for CAN.

}  // namespace absenc::raa38
