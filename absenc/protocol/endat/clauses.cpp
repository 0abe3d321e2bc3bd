// SPDX-License-Identifier: Apache-2.0
// Requirements of EnDat on encoders, for conformance tests. Paragraphs are those of README.md. Hosts are not judged,
// because no port of this machine takes the encoder's side of a data line that turns.
#include <array>

#include "absenc/protocol/endat/reading.hpp"
#include "absenc/protocol/endat/unit.hpp"

namespace absenc::endat {
namespace {

/// Requirements on EnDat encoders.
constexpr auto clauses = std::array{
    Clause{"crc", "Checksum", "five bits of CRC, inverted, over the error bits and the position", Demand::checked},
    Clause{.id = "start-bit",
           .paragraph = "The line",
           .words = "behind the mode command zeros, then the start bit within latency_us",
           .demand = Demand::as_drawn,
           .errors = any_of(Error::line_stuck, Error::truncated)},
    Clause{.id = "memory-write",
           .paragraph = "Memory",
           .words = "a word that was written is read again",
           .demand = Demand::byte_written,
           .page = 0xA9,
           .address = 8},
    Clause{.id = "memory-beside",
           .paragraph = "Memory",
           .words = "writing a word leaves those beside it",
           .demand = Demand::byte_alone,
           .page = 0xA9,
           .address = 8},
    // The zero resets the encoder, which ends warnings; positions report warnings only with additional information. So
    // with information the clause about warnings is tested instead.
    Clause{.id = "zero",
           .paragraph = "Zero by datum shift",
           .words = "the datum shift makes this the zero of the turn, to a signal period",
           .demand = Demand::zero,
           .needs = "info1=0x00"},
    Clause{.id = "clear-alarms",
           .paragraph = "Alarms",
           .words = "0 written to the warnings clears them, and nothing else",
           .demand = Demand::reset,
           .needs = "info1!=0x00",
           .value = alarm::warnings,
           .verb = Verb::clear_alarms,
           .shown_with = "info1=0x40"},
};

}  // namespace

constinit const Clauses unit_clauses{clauses, {}};

}  // namespace absenc::endat
