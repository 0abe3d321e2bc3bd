// SPDX-License-Identifier: Apache-2.0
// The clauses of the T-format document for encoders and hosts, with their paragraphs, for conformance tests.
#include <array>

#include "absenc/protocol/tformat/frame.hpp"
#include "absenc/protocol/tformat/unit.hpp"

namespace absenc::tformat {
namespace {

/// Alarms that a reset must clear; over_heat is left out, because it returns as long as the encoder is hot.
constexpr std::int64_t latched_alarms = alarms::latched & ~alarms::over_heat;

constexpr std::array<std::int64_t, 1> first_byte{0};   // address of the first byte of the user's EEPROM
constexpr std::array<std::int64_t, 1> closed_byte{6};  // an address of page 7 that users cannot access

/// Clauses of the T-format document for encoders.
constexpr auto clauses = std::array{
    Clause{"answer", "6.2.1", "a readout request is answered", Demand::answered},
    Clause{"answer-time", "8.1",
           "the answer begins 3 us after the request, which is typical: no later than a host waits", Demand::in_time},
    Clause{"length", "6.3.3 Table 2", "a reply has the fields of its data ID", Demand::whole},
    Clause{"crc", "6.3.4", "the CRC field is that of all fields before it", Demand::checked},
    Clause{"fields", "6.3", "the control field is that of the request, fixed bits are as drawn", Demand::as_drawn},
    Clause{.id = "bad-sync",
           .paragraph = "8.4 Table 5 (1)",
           .words = "a request with a wrong sync code is not answered",
           .demand = Demand::reacts,
           .ask = {.wire = "1f"}},
    Clause{.id = "unknown-id",
           .paragraph = "8.4 Table 5 (2)",
           .words = "an unknown data ID gets the data of data ID 3",
           .demand = Demand::reacts,
           .ask = {.wire = "a2"},
           .reaction = Reaction::reply,
           .as = "position"},
    Clause{.id = "bad-parity",
           .paragraph = "8.4 Table 5 (3), 6.3.2 (4)",
           .words = "a wrong parity bit gets the data of data ID 3, with the communication alarm ca0",
           .demand = Demand::reacts,
           .ask = {.wire = "9a"},
           .reaction = Reaction::refusal,
           .as = "position"},
    Clause{.id = "bad-delimiter",
           .paragraph = "8.4 Table 5 (4), 6.3.2 (4)",
           .words = "a wrong delimiter gets the data of data ID 3, with the communication alarm ca1",
           .demand = Demand::reacts,
           .ask = {.wire = "1a", .permille = 944},
           .reaction = Reaction::refusal,
           .as = "position"},
    Clause{.id = "memory-parity",
           .paragraph = "9.4 Table 6 (4), 6.3.2 (4)",
           .words = "a request to the EEPROM with a wrong parity bit gets the data of data ID 3, with ca0",
           .demand = Demand::reacts,
           .ask = {.wire = "6a 00 6a"},
           .reaction = Reaction::refusal,
           .as = "position"},
    Clause{.id = "memory-crc",
           .paragraph = "9.4 Table 6 (6)",
           .words = "a request to the EEPROM with a wrong CRC gets the data of data ID 3",
           .demand = Demand::reacts,
           .ask = {.command = "memory-read", .arguments = first_byte, .wrong_end = true},
           .reaction = Reaction::reply,
           .as = "position"},
    Clause{.id = "eeprom-write",
           .paragraph = "6.2.2, 6.2.3",
           .words = "a byte that was written to the EEPROM is read again",
           .demand = Demand::byte_written,
           .address = 0x7E},
    Clause{.id = "eeprom-beside",
           .paragraph = "6.2.2",
           .words = "writing a byte leaves those beside it",
           .demand = Demand::byte_alone,
           .address = 0x7E},
    Clause{.id = "eeprom-page",
           .paragraph = "6.3.5 (2) Table 4",
           .words = "each page has bytes of its own",
           .demand = Demand::page_alone,
           .address = 0x7E,
           .other = 1},
    Clause{.id = "eeprom-busy",
           .paragraph = "6.3.5 (3) Table 5",
           .words = "while a byte is written, a readout is answered with the busy bit and 00",
           .demand = Demand::byte_busy,
           .address = 0x7E},
    Clause{.id = "closed-address",
           .paragraph = "9.4 Table 6 (2)",
           .words = "an address that is not open for the user gets the data of data ID 3",
           .demand = Demand::page_closed,
           .ask = {.command = "memory-read", .arguments = closed_byte},
           .reaction = Reaction::reply,
           .as = "position",
           .page = 7,
           .address = 5},
    Clause{.id = "zero",
           .paragraph = "10",
           .words = "ten requests with data ID 8 make this the zero of the turn",
           .demand = Demand::zero},
    Clause{.id = "clear-alarms",
           .paragraph = "10",
           .words = "ten requests with data ID 7 reset all errors, and nothing else",
           .demand = Demand::reset,
           .value = latched_alarms,
           .verb = Verb::clear_alarms},
    Clause{.id = "reset-multiturn",
           .paragraph = "10",
           .words = "ten requests with data ID C reset the turns and all errors, not the position",
           .demand = Demand::reset,
           .verb = Verb::reset_multiturn},
};

// ---- Steps of hosts that break a clause, or show its case

namespace script {
using std::chrono::microseconds;
using std::chrono::milliseconds;
constexpr std::array<std::int64_t, 2> byte_1{1, 5};
constexpr std::array<std::int64_t, 2> byte_2{2, 5};
constexpr std::array<std::int64_t, 1> at_1{1};
constexpr std::array<std::int64_t, 1> at_2{2};

constexpr auto nine_zeros =
    std::array{HostStep{microseconds(100), "zero", {}, 9}, HostStep{microseconds(100), "position"}};
constexpr auto one_clear =
    std::array{HostStep{microseconds(100), "clear-alarms"}, HostStep{microseconds(100), "reset-multiturn", {}, 10}};
constexpr auto two_writes =
    std::array{HostStep{{}, "memory-write", byte_1}, HostStep{milliseconds(5), "memory-write", byte_2}};
constexpr auto write_and_again =
    std::array{HostStep{{}, "memory-write", byte_1}, HostStep{milliseconds(17), "memory-write", byte_1}};
constexpr auto other_after_busy =
    std::array{HostStep{{}, "memory-write", byte_1}, HostStep{milliseconds(5), "memory-read", at_1},
               HostStep{milliseconds(20), "memory-read", at_2}};
constexpr auto write_after_busy =
    std::array{HostStep{{}, "memory-write", byte_1}, HostStep{milliseconds(5), "memory-read", at_2},
               HostStep{milliseconds(20), "memory-write", byte_2}};
constexpr auto same_after_busy =
    std::array{HostStep{{}, "memory-write", byte_1}, HostStep{milliseconds(5), "memory-read", at_1},
               HostStep{milliseconds(20), "memory-read", at_1}};
constexpr auto two_at_once = std::array{HostStep{{}, "1a 1a"}};
constexpr auto three_at_once = std::array{HostStep{{}, "1a 1a 1a"}};
}  // namespace script

/// Clauses of the T-format document for hosts.
constexpr std::array<HostClause, 11> host_clauses{{
    {"asks", "6.2", "requests are as drawn", HostDemand::asks},
    {"silence", "8.4 Table 5 (1)", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "6.3.4", "after a damaged reply it asks again", HostDemand::after_damage},
    {"refusal", "6.3.2 (4)", "after ca0 or ca1, or silence, for a damaged request it asks again",
     HostDemand::after_refusal},
    {.id = "turn",
     .paragraph = "11",
     .words = "a request waits until the reply before it is over",
     .demand = HostDemand::rule,
     .rule = "request during the encoder's transmission",
     .breaks = {script::two_at_once, script::three_at_once}},
    {"page", "6.3.5 (2)", "after a change of the page the EEPROM is left alone for 18 ms", HostDemand::rule,
     "memory access before the page is ready"},
    {.id = "write-busy",
     .paragraph = "6.3.5 (3) Table 5",
     .words = "nothing is written while the encoder still writes, up to 18 ms",
     .demand = HostDemand::rule,
     .rule = "memory written while the encoder writes",
     .breaks = {script::two_writes, script::write_and_again}},
    {.id = "busy-again",
     .paragraph = "6.3.5 (3) Table 5",
     .words = "a readout that was refused as busy is sent again",
     .demand = HostDemand::row,
     .rule = "what was refused as busy was not asked for again",
     .breaks = {script::other_after_busy, script::write_after_busy},
     .keeps = script::same_after_busy},
    {.id = "reset-ten",
     .paragraph = "10",
     .words = "a reset is sent ten times in one sequence",
     .demand = HostDemand::row,
     .rule = "reset not sent ten times in a row",
     .breaks = {script::nine_zeros, script::one_clear}},
    {"reset-interval", "10", "the ten requests of a reset are 40 us apart, or more", HostDemand::rule,
     "reset sent too fast: less than 40 us after the one before"},
    {"reset-standing", "10", "a reset is sent while the shaft stands", HostDemand::rule, "reset while the shaft turns"},
}};

}  // namespace

constinit const Clauses unit_clauses{clauses, host_clauses};

}  // namespace absenc::tformat
