// SPDX-License-Identifier: Apache-2.0
// What the document demands of the encoder, with the place that says so.
#pragma once

#include <array>

#include "absenc/protocol/clause.hpp"

namespace absenc::ssi {

inline constexpr std::array<Clause, 1> clauses{{
    {.id = "repeat",
     .paragraph = "3.5",
     .words = "when the clock goes on, the word comes again from its MSB",
     .demand = Demand::as_drawn,
     .option = "extra_clocks",
     .value = 1},
}};

}  // namespace absenc::ssi
