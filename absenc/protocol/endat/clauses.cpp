// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/endat/unit.hpp"

namespace absenc::endat {

const Clauses unit_clauses{};

}  // namespace absenc::endat
