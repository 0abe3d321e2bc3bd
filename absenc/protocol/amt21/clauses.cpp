// SPDX-License-Identifier: Apache-2.0
// Requirements of the protocol's document on encoder and host, each with its paragraph.
#include <array>

#include "absenc/protocol/amt21/unit.hpp"

namespace absenc::amt21 {
namespace {

/// Requirements of the document that an encoder must fulfil.
constexpr std::array<Clause, 7> clauses{{
    {"answer", "serial interface", "a request is answered", Demand::answered},
    {"answer-time", "serial interface",
     "the answer begins after the turn-around time of its rate: no later than a host waits", Demand::in_time},
    {"length", "serial interface", "an answer is two bytes", Demand::whole},
    {"check", "serial interface, checksum", "K1 and K0 make the odd and the even bits odd in number", Demand::checked},
    {"address", "serial interface, address", "a request to another address is not answered", Demand::foreign_silent},
    {.id = "zero",
     .paragraph = "serial interface, extended commands",
     .words = "5E makes this the zero of the turn",
     .demand = Demand::zero,
     .needs = "multiturn_bits=0"},
    {.id = "reset",
     .paragraph = "serial interface, extended commands",
     .words = "a reset restarts the encoder, which answers again 200 ms later, at the same position",
     .demand = Demand::restarts,
     .value = 200,
     .command = "reset"},
}};

/// Requirements of the document that a host must fulfil.
constexpr std::array<HostClause, 4> host_clauses{{
    {"asks", "serial interface", "requests are as drawn", HostDemand::asks},
    {"silence", "serial interface", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "serial interface, checksum", "after a damaged reply it asks again", HostDemand::after_damage},
    {"turn", "serial interface", "a request waits until the reply before it is over", HostDemand::rule,
     "request during the encoder's transmission"},
}};

}  // namespace

constinit const Clauses unit_clauses{clauses, host_clauses};

}  // namespace absenc::amt21
