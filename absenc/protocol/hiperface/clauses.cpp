// SPDX-License-Identifier: Apache-2.0
// The clauses of HIPERFACE for encoders and hosts, for conformance tests. Paragraphs are those of the unit's README,
// which has the sources.
#include <array>

#include "absenc/protocol/clause.hpp"
#include "absenc/protocol/hiperface/unit.hpp"

namespace absenc::hiperface {
namespace {

/// Clauses of HIPERFACE for encoders.
constexpr auto clauses = std::array{
    Clause{"answer", "Frames", "a request is answered", Demand::answered},
    Clause{"answer-time", "Times", "the reply begins within 50 ms and 5 characters, as drivers wait", Demand::in_time},
    Clause{"length", "Frames", "a reply has the bytes of its command", Demand::whole},
    Clause{"check", "Frames", "the checksum is the exclusive OR of all bytes before it", Demand::checked},
    Clause{"fields", "Frames", "address and command are those of the request, bits above the position are 0",
           Demand::as_drawn},
    Clause{"address", "Addresses", "a request to another address is not answered", Demand::foreign_silent},
    Clause{.id = "data",
           .paragraph = "Commands, 4B",
           .words = "a byte that was stored in a data field is read again",
           .demand = Demand::byte_written,
           .address = 0x7E},
    Clause{.id = "data-beside",
           .paragraph = "Commands, 4B",
           .words = "storing a byte leaves those beside it",
           .demand = Demand::byte_alone,
           .address = 0x7E},
    Clause{.id = "zero",
           .paragraph = "Commands, 43",
           .words = "set position makes this the zero of the turn",
           .demand = Demand::zero},
    Clause{.id = "reset-multiturn",
           .paragraph = "Commands, 43",
           .words = "set position sets the turns to 0, and leaves the position within the turn",
           .demand = Demand::reset,
           .needs = "multiturn_bits!=0",
           .verb = Verb::reset_multiturn},
};

/// Clauses of HIPERFACE for hosts.
constexpr std::array<HostClause, 4> host_clauses{{
    {"asks", "Frames", "requests are as drawn", HostDemand::asks},
    {"silence", "Times", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "Frames", "after a damaged reply it asks again", HostDemand::after_damage},
    {"turn", "Times", "a request waits until the reply before it is over", HostDemand::rule,
     "request during the encoder's transmission"},
}};

}  // namespace

constinit const Clauses unit_clauses{clauses, host_clauses};

}  // namespace absenc::hiperface
