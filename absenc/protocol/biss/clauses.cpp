// SPDX-License-Identifier: Apache-2.0
// Requirements of the document on encoder and host, for conformance tests.
#include <array>

#include "absenc/protocol/biss/unit.hpp"

namespace absenc::biss {
namespace {

/// Errors that decoding reports for wrong bits before the data: idle bits, ACK, start bit and CDS.
constexpr Errors header_errors = any_of(Error::bad_framing, Error::line_stuck);

/// Requirements of the document on the registers of an encoder.
constexpr std::array<Clause, 3> register_clauses{{
    {.id = "bank",
     .paragraph = "BiSS C Protocol Description rev D2, register 40",
     .words = "the bank that was selected is read again",
     .demand = Demand::set,
     .value = 1,
     .setting = "bank",
     .field = "bank",
     .other = 0},
    {.id = "register-write",
     .paragraph = "BiSS C Protocol Description rev D2, register access",
     .words = "a byte that was written to a register of bank 0 is read again",
     .demand = Demand::byte_written,
     .address = 0x3F,
     .setting = "bank",
     .field = "bank"},
    {.id = "register-beside",
     .paragraph = "BiSS C Protocol Description rev D2, register access",
     .words = "writing a register leaves those beside it",
     .demand = Demand::byte_alone,
     .address = 0x3F,
     .setting = "bank",
     .field = "bank"},
}};

/// Returns the clauses `own`, followed by `register_clauses`.
template <std::size_t count>
constexpr std::array<Clause, count + register_clauses.size()> with_registers(const std::array<Clause, count>& own) {
  std::array<Clause, count + register_clauses.size()> all{};
  for (std::size_t i = 0; i < count; ++i) all[i] = own[i];
  for (std::size_t i = 0; i < register_clauses.size(); ++i) all[count + i] = register_clauses[i];
  return all;
}

/// Requirements of the document on a BiSS-C encoder with one word.
constexpr auto clauses = with_registers(std::array<Clause, 3>{{
    {"crc", "BiSS C timing diagram, CRC", "six bits of CRC, inverted, over position and status", Demand::checked},
    {.id = "header",
     .paragraph = "BiSS C timing diagram",
     .words = "ACK, start bit and CDS bit come before the position",
     .demand = Demand::as_drawn,
     .errors = header_errors},
    {.id = "life-counter",
     .paragraph = "BiSS Safety, LC",
     .words = "from frame to frame the life counter goes on by one",
     .demand = Demand::as_drawn,
     .needs = "life_counter=true",
     .errors = any_of(Error::sequence_mismatch),
     .shown_with = "life_counter=true"},
}});

/// Requirements on a BiSS Safety encoder, which sends a control word and a safety word.
constexpr auto safety_clauses = with_registers(std::array<Clause, 4>{{
    {"crc", "BiSS Safety, CPW and SPW", "CRC-6 over the control word, CRC-16 over the safety word, both inverted",
     Demand::checked},
    {.id = "header",
     .paragraph = "BiSS C timing diagram",
     .words = "ACK, start bit and CDS bit come before the words",
     .demand = Demand::as_drawn,
     .errors = header_errors},
    {.id = "life-counter",
     .paragraph = "BiSS Safety, LC",
     .words = "from frame to frame the life counter of the safety word goes on by one",
     .demand = Demand::as_drawn,
     .needs = "spw_life_counter=true",
     .errors = any_of(Error::sequence_mismatch)},
    {.id = "agreement",
     .paragraph = "BiSS Safety, CPW and SPW",
     .words = "the positions of both words agree within one count of the bits that are compared",
     .demand = Demand::as_drawn,
     .errors = any_of(Error::cross_check_failed),
     .shown_with = "motion=rpm=60"},
}});

/// Requirements on encoders in a chain.
constexpr auto chain_clauses = with_registers(std::array<Clause, 2>{{
    {"crc", "BiSS C timing diagram, CRC", "each encoder's CRC, inverted, over its own position and status",
     Demand::checked},
    {.id = "header",
     .paragraph = "BiSS C timing diagram",
     .words = "ACK, start bit and CDS bit come before the first encoder's word",
     .demand = Demand::as_drawn,
     .errors = header_errors},
}});

/// Requirements on the host of every BiSS unit: the timing of the line is the same for all.
constexpr std::array<HostClause, 7> host_clauses{{
    {"silence", "BiSS C timing diagram", "after SLO that stayed as it was it clocks again", HostDemand::after_silence},
    {"damage", "BiSS C timing diagram, CRC", "after a frame with a wrong CRC it clocks again",
     HostDemand::after_damage},
    {"fast", "BiSS C timing diagram, MA", "MA is no faster than 10 MHz", HostDemand::rule, "MA faster than 10 MHz"},
    {"slow", "BiSS C timing diagram, MA", "half a period of MA is shorter than the BiSS timeout", HostDemand::rule,
     "MA slower than the BiSS timeout allows"},
    {"pause", "BiSS C timing diagram, timeout", "between two frames it waits for the BiSS timeout", HostDemand::rule,
     "clocked before the BiSS timeout has passed"},
    {"clocks", "BiSS C timing diagram", "each bit of the frame, from ACK to CRC, has its clock", HostDemand::rule,
     "fewer clocks than the frame has bits"},
    {"mode", "BiSS C timing diagram, MA", "MA idles high", HostDemand::rule, spi_mode_rule},
}};

}  // namespace

constinit const Clauses unit_clauses{clauses, host_clauses};
constinit const Clauses safety_unit_clauses{safety_clauses, host_clauses};
constinit const Clauses chain_unit_clauses{chain_clauses, host_clauses};

}  // namespace absenc::biss
