// SPDX-License-Identifier: Apache-2.0
// The clauses of the ESL document for encoders and hosts, with their paragraphs.
#include <array>

#include "absenc/protocol/esl/frame.hpp"
#include "absenc/protocol/esl/unit.hpp"

namespace absenc::esl {
namespace {

// ---- Requests that no host sends

namespace request {
// Writes a position request with the control field `field`, and returns its length in bytes.
inline Result<std::size_t> seal(const Profile& profile, std::uint8_t field, MutableBytes request) {
  const std::size_t size = request_length(profile, DataId::position);
  if (request.size() < size) return Error::buffer_too_small;
  request[0] = field;
  if (size > 1) request[1] = checksum8(profile.crc_bit_order, Bytes(request).first(1));
  return size;
}
// Writes a position request whose only error is a wrong parity bit, and returns its length in bytes.
inline Result<std::size_t> wrong_parity(const Options& values, MutableBytes request) {
  const Profile profile = options.format(values);
  const std::uint8_t good = control_field(profile, profile.address, DataId::position);
  return seal(profile, static_cast<std::uint8_t>(good ^ 0x80U), request);
}
// Writes a request with data ID 3, which Table 3 does not list.
inline Result<std::size_t> unknown_id(const Options& values, MutableBytes request) {
  const Profile profile = options.format(values);
  return seal(profile, control_field(profile, profile.address, DataId{3}), request);
}
}  // namespace request

/// Alarms of both channels that the reset with data ID C alone clears (mask of Reading::alarms).
constexpr std::int64_t cleared_by_c = alarms::xc_error | alarms::xc_error << 8;

/// Clauses of the ESL document for encoders, as the conformance test checks them.
constexpr auto clauses = std::array{
    Clause{"answer", "Figure 2", "a read request is answered", Demand::answered},
    Clause{"answer-time", "Figure 2",
           "the answer begins 2.0 us after the request, which is typical: no later than a host waits", Demand::in_time},
    Clause{"length", "Table 12", "a reply has the frames of its command", Demand::whole},
    Clause{"crc", "Figures 10 and 11", "each channel ends with its CRC", Demand::checked},
    Clause{"fields", "Figures 7 and 8",
           "the command frame is that of the request, each channel names itself, and both agree", Demand::as_drawn},
    Clause{.id = "safe-position",
           .paragraph = "Tables 5 and 6",
           .words = "a safe position passes every check: both channels ready, no error, the sequence counter moves",
           .demand = Demand::does,
           .needs = "require_forced_test=false",
           .command = "safe-position"},
    Clause{"address", "Figure 7", "a request to another encoder address is not answered", Demand::foreign_silent},
    Clause{.id = "bad-crc",
           .paragraph = "Overview of Communication",
           .words = "a request with a wrong CRC is not answered",
           .demand = Demand::reacts,
           .needs = "request_crc=true",
           .ask = {.wrong_end = true}},
    Clause{.id = "bad-parity",
           .paragraph = "Table 5, Overview of Communication",
           .words = "a request with a wrong parity bit is refused with CA0, or not answered: the document says both",
           .demand = Demand::reacts,
           .ask = {.make = request::wrong_parity},
           .reaction = Reaction::refusal_or_silent},
    Clause{.id = "unknown-id",
           .paragraph = "Table 3, Overview of Communication",
           .words = "a request with an ID that Table 3 does not list is not answered",
           .demand = Demand::reacts,
           .ask = {.make = request::unknown_id}},
    Clause{.id = "eeprom-write",
           .paragraph = "Figure 5",
           .words = "a byte that was written to the EEPROM is read again",
           .demand = Demand::byte_written,
           .address = 0x7E},
    Clause{.id = "eeprom-beside",
           .paragraph = "Figure 5",
           .words = "writing a byte leaves those beside it",
           .demand = Demand::byte_alone,
           .address = 0x7E},
    Clause{.id = "eeprom-page",
           .paragraph = "Table 11, note 2",
           .words = "each page has bytes of its own",
           .demand = Demand::page_alone,
           .address = 0x7E,
           .other = 1},
    Clause{.id = "eeprom-busy",
           .paragraph = "Table 10",
           .words = "while a byte is written, a readout is answered with the busy bit and 00",
           .demand = Demand::byte_busy,
           .address = 0x7E},
    Clause{.id = "zero",
           .paragraph = "Table 4",
           .words = "eight requests with command B make this the zero of the turn",
           .demand = Demand::zero},
    Clause{.id = "clear-alarms",
           .paragraph = "Table 4, Table 8",
           .words = "eight requests with command C clear the errors that it can clear, and nothing else",
           .demand = Demand::reset,
           .value = cleared_by_c,
           .verb = Verb::clear_alarms},
    Clause{.id = "reset-multiturn",
           .paragraph = "Table 4",
           .words = "eight requests with command D clear the turn counter",
           .demand = Demand::reset,
           .verb = Verb::reset_multiturn},
};

// ---- Steps of hosts that break a clause, or show its case

namespace script {
using std::chrono::microseconds;
using std::chrono::milliseconds;
constexpr std::array<std::int64_t, 1> page_0{0};
constexpr std::array<std::int64_t, 2> byte_1{1, 5};
constexpr std::array<std::int64_t, 2> byte_2{2, 5};
constexpr std::array<std::int64_t, 1> at_1{1};
constexpr std::array<std::int64_t, 1> at_2{2};
constexpr HostStep select{milliseconds(20), "select-page", page_0};

constexpr auto seven_clears =
    std::array{HostStep{microseconds(100), "clear-alarms", {}, 7}, HostStep{microseconds(100), "position"}};
constexpr auto one_zero =
    std::array{HostStep{microseconds(100), "zero"}, HostStep{microseconds(100), "clear-alarms", {}, 8}};
constexpr auto two_writes = std::array{select, HostStep{milliseconds(20), "memory-write", byte_1},
                                       HostStep{milliseconds(5), "memory-write", byte_2}};
constexpr auto write_and_again = std::array{select, HostStep{milliseconds(20), "memory-write", byte_1},
                                            HostStep{milliseconds(1), "memory-write", byte_1}};
constexpr auto asked_once = std::array{select, HostStep{milliseconds(20), "memory-read", at_1},
                                       HostStep{milliseconds(20), "memory-read", at_2}};
constexpr auto asked_and_written = std::array{select, HostStep{milliseconds(20), "memory-read", at_1},
                                              HostStep{milliseconds(20), "memory-write", byte_2}};
}  // namespace script

/// Clauses of the ESL document for hosts, as the conformance test checks them.
constexpr std::array<HostClause, 12> host_clauses{{
    {"asks", "Figure 2", "requests are as drawn", HostDemand::asks},
    {"silence", "Overview of Communication", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "Figures 10 and 11", "after a damaged reply it asks again", HostDemand::after_damage},
    {"turn", "Table 1, Figure 1", "a request waits until the reply before it is over", HostDemand::rule,
     "request during the encoder's transmission"},
    {"page", "Table 11, note 3", "after a change of the page the memory is left alone", HostDemand::rule,
     "memory access before the page is ready"},
    {"eeprom-read", "Figure 3 (b)", "the two requests that read a byte are more than 200 us apart", HostDemand::rule,
     "memory read again less than 200 us after the request before"},
    {.id = "eeprom-again",
     .paragraph = "Figure 3 (a)",
     .words = "a byte of the EEPROM is asked for twice",
     .demand = HostDemand::row,
     .rule = "an EEPROM byte asked for only once",
     .breaks = {script::asked_once, script::asked_and_written}},
    {.id = "eeprom-write",
     .paragraph = "Figure 5 (e)",
     .words = "two writes to the EEPROM are more than 6 ms apart",
     .demand = HostDemand::rule,
     .rule = "memory written less than 6 ms after the write before",
     .breaks = {script::two_writes, script::write_and_again}},
    {.id = "reset-eight",
     .paragraph = "Table 4",
     .words = "a reset is sent eight times in a row, or more",
     .demand = HostDemand::row,
     .rule = "reset not sent eight times in a row",
     .breaks = {script::seven_clears, script::one_zero}},
    {"reset-interval", "Table 4", "the requests of a reset are about 40 us apart, not much less", HostDemand::rule,
     "reset sent too fast: much less than 40 us after the one before"},
    {"reset-standing", "Table 4", "a reset is sent while the shaft stands", HostDemand::rule,
     "reset while the shaft turns"},
    {"addressing", "Table 12", "ID 8 is not sent eight times in a row", HostDemand::rule,
     "ID 8 sent eight times in a row: dynamic addressing, which nothing describes"},
}};

}  // namespace

constinit const Clauses unit_clauses{clauses, host_clauses};

}  // namespace absenc::esl
