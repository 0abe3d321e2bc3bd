// SPDX-License-Identifier: Apache-2.0
// The EncoLink protocol as two units for the list of units, one for each interface.
#pragma once

#include "absenc/protocol/clause.hpp"

namespace absenc::encolink {

extern constinit const Unit unit;       ///< EncoLink on a UART.
extern constinit const Unit spi_unit;   ///< EncoLink on SPI.
extern const Clauses unit_clauses;      ///< The demands on EncoLink on a UART.
extern const Clauses spi_unit_clauses;  ///< The demands on EncoLink on SPI.

}  // namespace absenc::encolink
