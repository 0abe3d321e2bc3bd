// SPDX-License-Identifier: Apache-2.0
// What the document demands of the encoder, with the place that says so.
#pragma once

#include <array>

#include "absenc/protocol/clause.hpp"

namespace absenc::raa38 {

inline constexpr std::array<Clause, 2> serial_clauses{{
    {"frames", "3.1", "frames come in the mode that was ordered", Demand::answered},
    {"sum", "3.1.1", "a frame ends with the sum of its bytes", Demand::checked},
}};

inline constexpr std::array<Clause, 8> modbus_clauses{{
    {"answer", "3.1.7", "function 03 is answered", Demand::answered},
    {"length", "3.1.7 (5)", "an answer has as many bytes as its registers need", Demand::whole},
    {"crc", "3.1.7", "an answer ends with its CRC", Demand::checked},
    {"header", "3.1.7 (5)", "address and function are those of the request", Demand::as_drawn},
    {"address", "3.1.7", "a request to another address is not answered", Demand::foreign_silent},
    {"bad-crc", "3.1.7", "a request with a wrong CRC is not answered", Demand::damaged_silent},
    // What nothing reads, the direction, and what nothing takes back, the zero, is left alone.
    {.id = "set-address",
     .paragraph = "3.1.7 (5)",
     .words = "the encoder answers at the address that it was given",
     .demand = Demand::set,
     .value = 0x20,
     .setting = "address",
     .field = "address",
     .other = 0x21},
    {.id = "set-baud",
     .paragraph = "3.1.7 (5)",
     .words = "the encoder answers at the baud rate that it was given",
     .demand = Demand::set,
     .value = 57'600,
     .setting = "baud",
     .field = "baud",
     .other = 9'600},
}};

inline constexpr std::array<Clause, 2> can_clauses{{
    {"answer", "3.4.1", "command 80 is answered", Demand::answered},
    {"node", "3.4.1", "a request to another node is not answered", Demand::foreign_silent},
}};

inline constexpr std::array<HostClause, 7> modbus_host_clauses{{
    {"asks", "3.1.7", "requests are as drawn", HostDemand::asks},
    {"silence", "3.1.7", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "3.1.7", "after a damaged reply it asks again", HostDemand::after_damage},
    {"turn", "3.1.7 (5)", "a request waits until the reply before it is over", HostDemand::rule,
     "something was sent during the encoder's transmission"},
    {"gap", "3.1.7 (5)", "3.5 characters of silence come before a request", HostDemand::rule,
     "less than 3.5 characters of silence before a request"},
    {"parameter", "3.1.7 (5)", "a parameter is one of those listed", HostDemand::rule,
     "a parameter was set that the document does not have"},
    {"wear", "3.1.7 (3)", "parameters are not sent regularly", HostDemand::rule,
     "settings are sent again and again: the memory wears out"},
}};

// Of the modes only bus is one in which bytes ask.
inline constexpr std::array<HostClause, 4> serial_host_clauses{{
    {"asks", "3.1.5 (1)", "requests are as drawn", HostDemand::asks},
    {"silence", "3.1.5 (1)", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "3.1.5 (2)", "after a damaged reply it asks again", HostDemand::after_damage},
    {"turn", "3.1.5 (3)", "on the one pair of wires a request waits until the reply before it is over",
     HostDemand::rule, "request during the encoder's transmission"},
}};

inline constexpr std::array<HostClause, 10> can_host_clauses{{
    {"asks", "3.4.1 (3)", "requests are as drawn", HostDemand::asks},
    {"silence", "3.4.1 (3)", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "3.4.1 (3)", "after a reply that is none it asks again", HostDemand::after_damage},
    {"length", "3.4.1 (3)", "frames have 8 bytes of data", HostDemand::rule, "a frame without its 8 bytes of data"},
    {"node", "3.4.1 (3)", "the second byte is the node's number", HostDemand::rule,
     "the second byte is not the node's number"},
    {"command", "3.4.1 (3)", "only commands of the tables are sent", HostDemand::rule, "an unknown command"},
    {"configuration", "3.4.1 (3) 2, 3", "node and baud rate are set in configuration mode only", HostDemand::rule,
     "a setting without configuration mode"},
    {"configuration-command", "3.4.1 (3) 2, 3", "in configuration mode only node and baud rate are set",
     HostDemand::rule, "an unknown configuration command"},
    {"number", "3.4.1 (3) 2", "a node is given a number from 1 on", HostDemand::rule, "a node number of 0"},
    {"rate", "3.4.1 (3) 3", "a baud rate is 00, 02 or 03", HostDemand::rule, "an unknown bit rate"},
}};

}  // namespace absenc::raa38
