// SPDX-License-Identifier: Apache-2.0
// Requirements of the document on encoder and host, for conformance tests.
#include <array>

#include "absenc/protocol/e201/unit.hpp"

namespace absenc::e201 {
namespace {

/// Requirements of the document that an encoder must fulfil.
constexpr std::array<Clause, 5> clauses{{
    {"answer", "BiSS C timing diagram, command 4", "4 is answered", Demand::answered},
    {"length", "BiSS C timing diagram, command 4", "the answer is 16 hexadecimal digits and CR", Demand::whole},
    {.id = "crc",
     .paragraph = "BiSS C timing diagram, CRC",
     .words = "six bits of CRC, inverted, over position and status",
     .demand = Demand::checked,
     .needs = "carries=biss"},
    {.id = "header",
     .paragraph = "BiSS C timing diagram, command 4",
     .words = "ACK, start bit and CDS bit come before the position",
     .demand = Demand::as_drawn,
     .needs = "carries=biss"},
    {.id = "clock",
     .paragraph = "BiSS C timing diagram, command Mn",
     .words = "the MA clock is what it was set to",
     .demand = Demand::set,
     .value = 3,
     .setting = "clock",
     .field = "clock",
     .other = 4},
}};

// ---- Requests of hosts that break a clause

namespace script {
constexpr auto no_number = std::array{HostStep{{}, "4d 0d"}};
constexpr auto letter = std::array{HostStep{{}, "4d 41"}};
}  // namespace script

/// Requirements of the document that a host must fulfil.
constexpr std::array<HostClause, 4> host_clauses{{
    {"asks", "BiSS C timing diagram, command 4", "only commands of the interface are sent", HostDemand::asks},
    {"silence", "BiSS C timing diagram, command 4", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "BiSS C timing diagram, CRC", "after a damaged reply it asks again", HostDemand::after_damage},
    {.id = "clock",
     .paragraph = "BiSS C timing diagram, command Mn",
     .words = "M is sent with the number of a clock",
     .demand = HostDemand::rule,
     .rule = "a command without its number",
     .breaks = {script::no_number, script::letter}},
}};

}  // namespace

constinit const Clauses unit_clauses{clauses, host_clauses};

}  // namespace absenc::e201
