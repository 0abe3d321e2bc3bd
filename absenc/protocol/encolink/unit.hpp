// SPDX-License-Identifier: Apache-2.0
// The EncoLink protocol as two units for the list of units, one for each interface.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::encolink {

extern constinit const Unit unit;       ///< Protocol unit of EncoLink on a UART.
extern constinit const Unit spi_unit;   ///< Protocol unit of EncoLink on SPI.
extern const Clauses unit_clauses;      ///< Clauses of the EncoLink document for UART, for conformance tests.
extern const Clauses spi_unit_clauses;  ///< Clauses of the EncoLink document for SPI, for conformance tests.

}  // namespace absenc::encolink
