// SPDX-License-Identifier: Apache-2.0
// What the document demands of the encoder, with the place that says so.
#pragma once

#include <array>

#include "absenc/protocol/clause.hpp"

namespace absenc::amt21 {

inline constexpr std::array<Clause, 5> clauses{{
    {"answer", "serial interface", "a request is answered", Demand::answered},
    {"answer-time", "serial interface", "the answer begins after the turn-around time of its rate", Demand::in_time},
    {"length", "serial interface", "an answer is two bytes", Demand::whole},
    {"check", "serial interface, checksum", "K1 and K0 make the odd and the even bits odd in number", Demand::checked},
    {"address", "serial interface, address", "a request to another address is not answered", Demand::foreign_silent},
}};

inline constexpr std::array<HostClause, 3> host_clauses{{
    {"asks", "serial interface", "requests are as drawn", HostDemand::asks},
    {"silence", "serial interface", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "serial interface, checksum", "after a damaged reply it asks again", HostDemand::after_damage},
}};

}  // namespace absenc::amt21
