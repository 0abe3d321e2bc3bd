// SPDX-License-Identifier: Apache-2.0
// What the document demands of the encoder, with the place that says so.
#pragma once

#include <array>

#include "absenc/protocol/clause.hpp"

namespace absenc::esl {

inline constexpr std::array<Clause, 6> clauses{{
    {"answer", "Figure 2", "a read request is answered", Demand::answered},
    {"answer-time", "Figure 2", "the answer begins 2.0 us after the request", Demand::in_time},
    {"length", "Table 12", "a reply has the frames of its command", Demand::whole},
    {"crc", "Figures 10 and 11", "each channel ends with its CRC", Demand::checked},
    {"fields", "Figures 7 and 8", "the command frame is that of the request, each channel names itself, and both agree",
     Demand::as_drawn},
    {"address", "Figure 7", "a request to another encoder address is not answered", Demand::foreign_silent},
}};

}  // namespace absenc::esl
