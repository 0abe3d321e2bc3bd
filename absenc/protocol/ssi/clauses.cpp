// SPDX-License-Identifier: Apache-2.0
// Requirements of the document on encoder and host, for conformance tests.
#include <array>

#include "absenc/protocol/ssi/unit.hpp"

namespace absenc::ssi {
namespace {

/// Requirements of the document that an encoder must fulfil.
constexpr std::array<Clause, 1> clauses{{
    {.id = "repeat",
     .paragraph = "3.5",
     .words = "when the clock goes on, the word comes again from its MSB",
     .demand = Demand::as_drawn,
     .needs = "after_word=repeat",
     .option = "extra_clocks",
     .value = 1,
     .shown_with = "singleturn=1000"},
}};

/// Requirements of the document that a host must fulfil.
constexpr std::array<HostClause, 5> host_clauses{{
    {"silence", "3.5", "after a data line that stayed as it was it clocks again", HostDemand::after_silence},
    {"speed", "3.5", "the clock is within the limits of the encoder", HostDemand::rule,
     "clock outside min_clock_khz to max_clock_khz"},
    {"pause", "3.5", "between two words it pauses for longer than Tm", HostDemand::rule,
     "clocked again within monoflop_us"},
    {"clocks", "3.5", "each bit of the word has its clock", HostDemand::rule, "fewer clocks than the word has bits"},
    {"mode", "3.5", "the clock idles high", HostDemand::rule, spi_mode_rule},
}};

}  // namespace

constinit const Clauses unit_clauses{clauses, host_clauses};

}  // namespace absenc::ssi
