// SPDX-License-Identifier: Apache-2.0
// Requirements of the A-format on encoders and hosts, for conformance tests. Paragraphs are those of README.md.
#include <array>

#include "absenc/protocol/nikon/format.hpp"
#include "absenc/protocol/nikon/unit.hpp"

namespace absenc::nikon {
namespace {

/// Mask of the alarm bits that must be clear after the alarms were cleared: all but memory_busy.
constexpr std::int64_t cleared_alarms = alarm::all & ~alarm::memory_busy;

/// Requirements on encoders with the A-format.
constexpr auto clauses = std::array{
    Clause{"answer", "Times", "a request is answered", Demand::answered},
    Clause{"answer-time", "Times", "the reply begins no later than a host waits", Demand::in_time},
    Clause{"length", "Frames", "a reply has the frames of its command code", Demand::whole},
    Clause{"check", "Frames", "a reply ends with the CRC-8 of its bits", Demand::checked},
    Clause{"form", "Frames", "a reply has the address and command code of its request, and fixed bits as drawn",
           Demand::as_drawn},
    Clause{"address", "Frames", "a request to another address is not answered", Demand::foreign_silent},
    Clause{.id = "bad-request",
           .paragraph = "Frames",
           .words = "a request whose CRC-3 is wrong is not answered",
           .demand = Demand::reacts,
           .needs = "address=0",
           .ask = {.wire = "02 20"},
           .reaction = Reaction::silent},
    Clause{.id = "eeprom-write",
           .paragraph = "EEPROM",
           .words = "a word that was written to the EEPROM is read again",
           .demand = Demand::byte_written,
           .address = 0x7E},
    Clause{.id = "eeprom-beside",
           .paragraph = "EEPROM",
           .words = "writing a word leaves those beside it",
           .demand = Demand::byte_alone,
           .address = 0x7E},
    Clause{.id = "identification",
           .paragraph = "Identification and address",
           .words = "an identification that was written is read again",
           .demand = Demand::set,
           .value = 0x123456,
           .setting = "identification",
           .field = "identification",
           .other = 0x654321},
    Clause{.id = "zero",
           .paragraph = "Resets",
           .words = "eight requests with CC 12 make this the zero of the turn",
           .demand = Demand::zero},
    Clause{.id = "clear-alarms",
           .paragraph = "Resets",
           .words = "eight requests with CC 8 clear the alarms, and nothing else",
           .demand = Demand::reset,
           .value = cleared_alarms,
           .verb = Verb::clear_alarms},
    Clause{.id = "reset-multiturn",
           .paragraph = "Resets",
           .words = "eight requests with CC 10 clear the turns and the alarms, not the position",
           .demand = Demand::reset,
           .needs = "multiturn_bits!=0",
           .verb = Verb::reset_multiturn},
};

// ---- Steps of hosts that break a clause, or show its case

namespace script {
using std::chrono::microseconds;
using std::chrono::milliseconds;
constexpr auto seven_zeros =
    std::array{HostStep{microseconds(100), "zero", {}, 7}, HostStep{microseconds(100), "position"}};
constexpr auto one_clear =
    std::array{HostStep{microseconds(100), "clear-alarms"}, HostStep{microseconds(100), "reset-multiturn", {}, 8}};
// Frames of the requests that read and write word 0x12 of the EEPROM.
constexpr HostStep read_word{milliseconds(40), "020d"};
constexpr HostStep write_word{milliseconds(40), "022e"};
constexpr HostStep low_byte{microseconds(15), "8a67"};
constexpr HostStep high_byte{microseconds(15), "520b"};
constexpr HostStep word_address{microseconds(15), "5a02"};
constexpr HostStep read_again{microseconds(100), "020d"};
constexpr HostStep read_soon{milliseconds(1), "020d"};
constexpr auto reads_at_once = std::array{read_word, word_address, read_again, word_address};
constexpr auto read_after_write = std::array{write_word, low_byte, high_byte, word_address, read_soon, word_address};
constexpr auto close_frames = std::array{read_word, HostStep{microseconds(5), "5a02"}};
constexpr auto closer_frames = std::array{read_word, HostStep{microseconds(1), "5a02"}};
constexpr auto apart_frames = std::array{read_word, word_address};
}  // namespace script

/// Requirements on hosts of encoders with the A-format.
constexpr std::array<HostClause, 8> host_clauses{{
    {"asks", "Frames", "requests are as drawn", HostDemand::asks},
    {"silence", "Times", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "Frames", "after a damaged reply it asks again", HostDemand::after_damage},
    {"turn", "Times", "a request waits until the reply before it is over", HostDemand::rule,
     "request during the encoder's transmission"},
    {.id = "row",
     .paragraph = "Resets",
     .words = "a reset is sent eight times in a row",
     .demand = HostDemand::row,
     .rule = "reset not sent eight times in a row",
     .breaks = {script::seven_zeros, script::one_clear}},
    {"row-interval", "Resets", "a request of a reset begins 10 us or more after the reply before it", HostDemand::rule,
     "reset sent less than 10 us after the reply before"},
    {.id = "memory-busy",
     .paragraph = "EEPROM",
     .words = "the EEPROM is left alone while it is busy",
     .demand = HostDemand::rule,
     .rule = "EEPROM accessed while it is busy",
     .breaks = {script::reads_at_once, script::read_after_write}},
    {.id = "frame-pause",
     .paragraph = "Times",
     .words = "the frames of one request are 10 us apart, or more",
     .demand = HostDemand::rule,
     .rule = "frames of a request less than 10 us apart",
     .breaks = {script::close_frames, script::closer_frames},
     .keeps = script::apart_frames},
}};

}  // namespace

constinit const Clauses unit_clauses{clauses, host_clauses};

}  // namespace absenc::nikon
