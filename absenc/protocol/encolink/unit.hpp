// SPDX-License-Identifier: Apache-2.0
// EncoLink as the neutral layers see it: one unit for each interface.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::encolink {

extern constinit const Unit unit;      // UART
extern constinit const Unit spi_unit;  // SPI

}  // namespace absenc::encolink
