// SPDX-License-Identifier: Apache-2.0
// The demands of the document on the encoder and on its host, each with the paragraph that states it.
#include <array>

#include "absenc/protocol/protocol_name/unit.hpp"

namespace absenc::protocol_name {
namespace {

constexpr std::array<Clause, 5> clauses{{
    {"answer", "invented 1", "a request is answered", Demand::answered},
    {"answer-time", "invented 1", "the reply begins no later than a host waits", Demand::in_time},
    {"length", "invented 1", "a reply has four bytes", Demand::whole},
    {"sum", "invented 1", "the fourth byte is the sum of the others", Demand::checked},
    {"address", "invented 2", "a request to another address is not answered", Demand::foreign_silent},
}};

constexpr std::array<HostClause, 3> host_clauses{{
    {"asks", "invented 1", "requests are as drawn", HostDemand::asks},
    {"silence", "invented 1", "after no reply the host asks again", HostDemand::after_silence},
    {"damage", "invented 1", "after a damaged reply the host asks again", HostDemand::after_damage},
}};

}  // namespace

constinit const Clauses unit_clauses{clauses, host_clauses};

}  // namespace absenc::protocol_name
