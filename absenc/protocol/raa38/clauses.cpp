// SPDX-License-Identifier: Apache-2.0
// Requirements of the document on encoder and host, for conformance tests.
#include <array>

#include "absenc/protocol/raa38/unit.hpp"

namespace absenc::raa38 {
namespace {

/// Requirements of the document that an encoder on a serial line must fulfil.
constexpr auto serial_clauses = std::array{
    Clause{.id = "frames",
           .paragraph = "3.1.3, 3.1.5",
           .words = "a pulse, or a request on a bus, is answered by a frame",
           .demand = Demand::answered,
           .shown_with = "mode=bus"},
    Clause{"stream", "3.1.1", "frames come by themselves in timing mode", Demand::streamed},
    Clause{.id = "header",
           .paragraph = "3.1.1 (2), 3.1.5 (2)",
           .words = "a frame begins with FF and 81, or on a bus with FF and its number",
           .demand = Demand::as_drawn,
           .errors = any_of(Error::unexpected_reply, Error::bad_framing)},
    Clause{.id = "length",
           .paragraph = "3.1.5 (2)",
           .words = "a frame has as many bytes as its bits need",
           .demand = Demand::whole,
           .needs = "mode!=timing",
           .shown_with = "mode=bus"},
    Clause{.id = "bits",
           .paragraph = "3.1.1 (2)",
           .words = "a position has no more bits than were ordered",
           .demand = Demand::as_drawn,
           .errors = any_of(Error::out_of_range)},
    Clause{"sum", "3.1.1 (2)", "a frame ends with the sum of its bytes", Demand::checked},
    Clause{.id = "number",
           .paragraph = "3.1.5 (1)",
           .words = "a request to another number is not answered",
           .demand = Demand::foreign_silent,
           .needs = "mode=bus",
           .shown_with = "mode=bus"},
    Clause{.id = "zero",
           .paragraph = "3.1.4 (5), 3.1.6",
           .words = "zero clearing makes this the zero of the turn",
           .demand = Demand::zero,
           .needs = "zeroing!=none",
           .shown_with = "mode=bus&zeroing=command"},
};

/// Requirements of the document that an encoder with Modbus RTU must fulfil.
constexpr std::array<Clause, 10> modbus_clauses{{
    {"answer", "3.1.7", "function 03 is answered", Demand::answered},
    {"length", "3.1.7 (5)", "an answer has as many bytes as its registers need", Demand::whole},
    {"crc", "3.1.7", "an answer ends with its CRC", Demand::checked},
    {"header", "3.1.7 (5)", "address and function are those of the request", Demand::as_drawn},
    {"address", "3.1.7", "a request to another address is not answered", Demand::foreign_silent},
    {.id = "bad-crc",
     .paragraph = "3.1.7",
     .words = "a request with a wrong CRC is not answered",
     .demand = Demand::reacts,
     .ask = {.wrong_end = true}},
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
    {.id = "direction",
     .paragraph = "3.1.7 (5)",
     .words = "of the parameters 01 and 02 one counts the other way",
     .demand = Demand::mirrored,
     .value = 2,
     .setting = "direction",
     .other = 1},
    {.id = "zero",
     .paragraph = "3.1.7 (5)",
     .words = "parameter 00 makes this the zero of the turn",
     .demand = Demand::zero},
}};

/// Requirements of the document that an encoder on CAN must fulfil.
constexpr auto can_clauses = std::array{
    Clause{"answer", "3.4.1 (3)", "command 80 is answered", Demand::answered},
    Clause{.id = "stream",
           .paragraph = "3.4.1 (2)",
           .words = "the node sends readings by itself",
           .demand = Demand::streamed,
           .shown_with = "listen=true"},
    Clause{.id = "identifier",
           .paragraph = "3.4.1 (3)",
           .words = "replies come with the 11 bits of the identifier 1NN",
           .demand = Demand::as_drawn,
           .errors = any_of(Error::unexpected_reply)},
    Clause{"length", "3.4.1 (3)", "frames have 8 bytes of data", Demand::whole},
    Clause{.id = "zeros",
           .paragraph = "3.4.1 (3)",
           .words = "behind the position all bytes are 0",
           .demand = Demand::as_drawn,
           .errors = any_of(Error::out_of_range)},
    Clause{"node", "3.4.1 (3)", "a request to another node is not answered", Demand::foreign_silent},
    // The encoder's clauses do not set node number and bit rate; README.md gives the reason.
    Clause{.id = "cyclic",
           .paragraph = "3.4.1 (3) 7, 8",
           .words = "after command 31 the node sends as many readings a second as it was told",
           .demand = Demand::paced,
           .value = 50,
           .command = "cyclic",
           .stop = "stop"},
    Clause{.id = "direction",
           .paragraph = "3.4.1 (3) 4, 5",
           .words = "of the two values of command 22 one counts the other way",
           .demand = Demand::mirrored,
           .value = 1,
           .setting = "direction",
           .other = 0},
    Clause{.id = "zero",
           .paragraph = "3.4.1 (3) 6",
           .words = "command 20 makes this the zero of the turn",
           .demand = Demand::zero},
};

// ---- Commands and frames of hosts that break a clause, or barely keep it

namespace script {
using std::chrono::milliseconds;
constexpr std::array<std::int64_t, 1> negative{1};
constexpr auto parameter_3 = std::array{HostStep{{}, "01 cc 03 35 01"}};
constexpr auto parameter_4 = std::array{HostStep{{}, "01 cc 04 74 c3"}};
constexpr auto direction_often = std::array{HostStep{milliseconds(20), "set-direction", negative, 12}};
constexpr auto zero_often = std::array{HostStep{milliseconds(20), "zero", {}, 12}};

constexpr auto two_at_once = std::array{HostStep{{}, "bc aa b1 bc aa b1"}};
// The second command begins 5 ms after the first, whose reply comes only after 20 ms (`acquisition_us`).
constexpr auto soon_again = std::array{HostStep{{}, "position"}, HostStep{milliseconds(5), "position"}};

constexpr HostStep enter{milliseconds(1), "7e5:0401000000000000"};
constexpr auto two_bytes = std::array{HostStep{{}, "220:8020"}};
constexpr auto seven_bytes = std::array{HostStep{{}, "220:80200000000000"}};
constexpr auto node_21 = std::array{HostStep{{}, "220:8021000000000000"}};
constexpr auto node_0 = std::array{HostStep{{}, "220:8000000000000000"}};
constexpr auto command_70 = std::array{HostStep{{}, "220:7020000000000000"}};
constexpr auto command_81 = std::array{HostStep{{}, "220:8120000000000000"}};
constexpr auto node_unprepared = std::array{HostStep{{}, "7e5:1121000000000000"}};
constexpr auto rate_unprepared = std::array{HostStep{{}, "7e5:1300030000000000"}};
constexpr auto configuration_44 = std::array{enter, HostStep{milliseconds(1), "7e5:4400000000000000"}};
constexpr auto configuration_17 = std::array{enter, HostStep{milliseconds(1), "7e5:1700000000000000"}};
constexpr auto number_0 = std::array{enter, HostStep{milliseconds(1), "7e5:1100000000000000"}};
constexpr auto number_0_later = std::array{enter, HostStep{milliseconds(1), "7e5:1121000000000000"},
                                           HostStep{milliseconds(1), "7e5:1100000000000000"}};
constexpr auto number_32 = std::array{enter, HostStep{milliseconds(1), "7e5:1120000000000000"}};
constexpr auto rate_1 = std::array{enter, HostStep{milliseconds(1), "7e5:1300010000000000"}};
constexpr auto rate_9 = std::array{enter, HostStep{milliseconds(1), "7e5:1300090000000000"}};
constexpr auto rate_3 = std::array{enter, HostStep{milliseconds(1), "7e5:1300030000000000"}};
}  // namespace script

/// Requirements of the document that a host with Modbus RTU must fulfil.
constexpr std::array<HostClause, 7> modbus_host_clauses{{
    {"asks", "3.1.7", "requests are as drawn", HostDemand::asks},
    {"silence", "3.1.7", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "3.1.7", "after a damaged reply it asks again", HostDemand::after_damage},
    {"turn", "3.1.7 (5)", "a request waits until the reply before it is over", HostDemand::rule,
     "something was sent during the encoder's transmission"},
    {"gap", "3.1.7 (5)", "3.5 characters of silence come before a request", HostDemand::rule,
     "less than 3.5 characters of silence before a request"},
    {.id = "parameter",
     .paragraph = "3.1.7 (5)",
     .words = "a parameter is one of those listed",
     .demand = HostDemand::rule,
     .rule = "a parameter was set that the document does not have",
     .breaks = {script::parameter_3, script::parameter_4}},
    {.id = "wear",
     .paragraph = "3.1.7 (3)",
     .words = "parameters are not sent regularly",
     .demand = HostDemand::rule,
     .rule = "settings are sent again and again: the memory wears out",
     .breaks = {script::direction_often, script::zero_often}},
}};

/// Requirements of the document that a host on a serial line must fulfil.
constexpr std::array<HostClause, 4> serial_host_clauses{{
    {"asks", "3.1.5 (1)", "requests are as drawn", HostDemand::asks},
    {"silence", "3.1.5 (1)", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "3.1.5 (2)", "after a damaged reply it asks again", HostDemand::after_damage},
    {.id = "turn",
     .paragraph = "3.1.5 (3)",
     .words = "on the one pair of wires a request waits until the reply before it is over",
     .demand = HostDemand::rule,
     .rule = "request during the encoder's transmission",
     .breaks = {script::two_at_once, script::soon_again},
     .options = "acquisition_us=20000"},
}};

/// Requirements of the document that a host on CAN must fulfil.
constexpr std::array<HostClause, 10> can_host_clauses{{
    {"asks", "3.4.1 (3)", "requests are as drawn", HostDemand::asks},
    {"silence", "3.4.1 (3)", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "3.4.1 (3)", "after a reply that is none it asks again", HostDemand::after_damage},
    {.id = "length",
     .paragraph = "3.4.1 (3)",
     .words = "frames have 8 bytes of data",
     .demand = HostDemand::rule,
     .rule = "a frame without its 8 bytes of data",
     .breaks = {script::two_bytes, script::seven_bytes}},
    {.id = "node",
     .paragraph = "3.4.1 (3)",
     .words = "the second byte is the node's number",
     .demand = HostDemand::rule,
     .rule = "the second byte is not the node's number",
     .breaks = {script::node_21, script::node_0}},
    {.id = "command",
     .paragraph = "3.4.1 (3)",
     .words = "only commands of the tables are sent",
     .demand = HostDemand::rule,
     .rule = "an unknown command",
     .breaks = {script::command_70, script::command_81}},
    {.id = "configuration",
     .paragraph = "3.4.1 (3) 2, 3",
     .words = "node and baud rate are set in configuration mode only",
     .demand = HostDemand::rule,
     .rule = "a setting without configuration mode",
     .breaks = {script::node_unprepared, script::rate_unprepared}},
    {.id = "configuration-command",
     .paragraph = "3.4.1 (3) 2, 3",
     .words = "in configuration mode only node and baud rate are set",
     .demand = HostDemand::rule,
     .rule = "an unknown configuration command",
     .breaks = {script::configuration_44, script::configuration_17}},
    {.id = "number",
     .paragraph = "3.4.1 (3) 2",
     .words = "a node is given a number from 1 on",
     .demand = HostDemand::rule,
     .rule = "a node number of 0",
     .breaks = {script::number_0, script::number_0_later},
     .keeps = script::number_32},
    {.id = "rate",
     .paragraph = "3.4.1 (3) 3",
     .words = "a baud rate is 00, 02 or 03",
     .demand = HostDemand::rule,
     .rule = "an unknown bit rate",
     .breaks = {script::rate_1, script::rate_9},
     .keeps = script::rate_3},
}};

}  // namespace

constinit const Clauses serial_unit_clauses{serial_clauses, serial_host_clauses};
constinit const Clauses modbus_unit_clauses{modbus_clauses, modbus_host_clauses};
constinit const Clauses can_unit_clauses{can_clauses, can_host_clauses};

}  // namespace absenc::raa38
