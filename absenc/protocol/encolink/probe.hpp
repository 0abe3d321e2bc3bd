// SPDX-License-Identifier: Apache-2.0
// What captures tell of the format of an encoder that cannot be asked.
#pragma once

#include <span>

#include "absenc/protocol/unit.hpp"

namespace absenc::encolink {

/// Unit::probe: resolution and turns by the identity; without one, whether there are turns by the length that most
/// position frames have, because of one frame with turns in 250 a shorter part has a good checksum too.
bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink);

}  // namespace absenc::encolink
