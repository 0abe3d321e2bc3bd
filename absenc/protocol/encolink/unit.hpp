// SPDX-License-Identifier: Apache-2.0
// The EncoLink protocol as units, one for each interface.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::encolink {

extern constinit const Unit unit;      ///< UART
extern constinit const Unit spi_unit;  ///< SPI

}  // namespace absenc::encolink
