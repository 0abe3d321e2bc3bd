// SPDX-License-Identifier: Apache-2.0
// The units of the RAA38S6 (on serial lines, with Modbus RTU, on CAN), and the clauses of their conformance tests.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::raa38 {

extern constinit const Unit serial_unit;   ///< Protocol unit of the RAA38S6 on RS-485, RS-232 or RS-422.
extern constinit const Unit modbus_unit;   ///< Protocol unit of the RAA38S6 with Modbus RTU.
extern constinit const Unit can_unit;      ///< Protocol unit of the RAA38S6 on CAN.
extern const Clauses serial_unit_clauses;  ///< Requirements on an RAA38S6 on a serial line, and on its host.
extern const Clauses modbus_unit_clauses;  ///< Requirements on an RAA38S6 with Modbus RTU, and on its host.
extern const Clauses can_unit_clauses;     ///< Requirements on an RAA38S6 on CAN, and on its host.

}  // namespace absenc::raa38
