// SPDX-License-Identifier: Apache-2.0
// What the document demands of the encoder, with the place that says so.
#pragma once

#include <array>

#include "absenc/protocol/clause.hpp"

namespace absenc::ssi {

inline constexpr std::array<Clause, 1> clauses{{
    {"word", "3.5", "the word comes while the clock runs, as drawn", Demand::as_drawn},
}};

}  // namespace absenc::ssi
