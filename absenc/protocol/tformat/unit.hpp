// SPDX-License-Identifier: Apache-2.0
// The protocol unit of the T-format, for the layers that know no protocol.
#pragma once

#include "absenc/protocol/unit.hpp"

namespace absenc::tformat {

extern constinit const Unit unit;  ///< Descriptor of the T-format.

}  // namespace absenc::tformat
