// SPDX-License-Identifier: Apache-2.0
// What captured frames tell of the options of raa38-modbus.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::rtu {

/// As Unit::probe: judges `bits` and `registers`. Whose address the frames have does not matter.
bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink);

}  // namespace absenc::raa38::rtu
