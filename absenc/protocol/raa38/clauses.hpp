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

inline constexpr std::array<Clause, 6> modbus_clauses{{
    {"answer", "3.1.7", "function 03 is answered", Demand::answered},
    {"length", "3.1.7 (5)", "an answer has as many bytes as its registers need", Demand::whole},
    {"crc", "3.1.7", "an answer ends with its CRC", Demand::checked},
    {"header", "3.1.7 (5)", "address and function are those of the request", Demand::as_drawn},
    {"address", "3.1.7", "a request to another address is not answered", Demand::foreign_silent},
    {"bad-crc", "3.1.7", "a request with a wrong CRC is not answered", Demand::damaged_silent},
}};

inline constexpr std::array<Clause, 2> can_clauses{{
    {"answer", "3.4.1", "command 80 is answered", Demand::answered},
    {"node", "3.4.1", "a request to another node is not answered", Demand::foreign_silent},
}};

inline constexpr std::array<HostClause, 5> modbus_host_clauses{{
    {"asks", "3.1.7", "requests are as drawn", HostDemand::asks},
    {"silence", "3.1.7", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "3.1.7", "after a damaged reply it asks again", HostDemand::after_damage},
    {"turn", "3.1.7", "a request waits until the reply before it is over", HostDemand::rule,
     "something was sent during the encoder's transmission"},
    {"gap", "3.1.7", "3.5 characters of silence come before a request", HostDemand::rule,
     "less than 3.5 characters of silence before a request"},
}};

}  // namespace absenc::raa38
