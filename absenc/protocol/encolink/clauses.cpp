// SPDX-License-Identifier: Apache-2.0
// Requirements of the EncoLink document on encoder and host, for conformance tests.
#include <array>

#include "absenc/protocol/encolink/unit.hpp"

namespace absenc::encolink {
namespace {

/// Requirements of the EncoLink document that an encoder on a UART must fulfil.
constexpr auto clauses = std::array{
    Clause{"answer", "UART, Communication parameters", "a request is answered", Demand::answered},
    Clause{.id = "stream",
           .paragraph = "UART, Communication parameters",
           .words = "an encoder that was set to it transmits by itself",
           .demand = Demand::streamed,
           .shown_with = "stream_rate=500&resolution=20&multiturn_bits=0"},
    Clause{"length", "UART, Channel 1", "a frame has position, status and CRC", Demand::whole},
    Clause{"crc", "UART, Channel 1", "the inverted CRC of polynomial 97 is right", Demand::checked},
    Clause{.id = "channel-2",
           .paragraph = "UART, Channel 2",
           .words = "after AA each cycle of channel 2 has a good CRC and the position of channel 1",
           .demand = Demand::does,
           .needs = "has_ch2=true stream_rate=0",
           .command = "alarms"},
    Clause{.id = "channel-3",
           .paragraph = "UART, Encoder programming",
           .words = "a register that is asked for is answered: idle, busy, ready, its bytes",
           .demand = Demand::does,
           .needs = "has_ch2=true stream_rate=0",
           .command = "temperature"},
    Clause{.id = "identity",
           .paragraph = "UART, Channel 1",
           .words = "the frame after BB carries the identity",
           .demand = Demand::does,
           .needs = "stream_rate=0",
           .command = "identify",
           .shown_with = "resolution=20&multiturn_bits=0"},
    Clause{.id = "offset",
           .paragraph = "UART, Encoder programming",
           .words = "a position offset that was written is read again",
           .demand = Demand::set,
           .value = 0x1000,
           .setting = "position-offset",
           .field = "position_offset",
           .other = 0x2000},
    Clause{.id = "zero",
           .paragraph = "UART, Encoder programming",
           .words = "the position offset moves the zero of the turn",
           .demand = Demand::zeroed,
           .value = 0,
           .setting = "position-offset",
           .field = "position_offset"},
};

/// Requirements of the EncoLink document that an encoder on SPI must fulfil.
constexpr auto spi_clauses = std::array{
    Clause{"answer", "SPI timing diagram", "the encoder drives its output while it is selected", Demand::answered},
    Clause{"crc", "SPI, Channel 1", "the inverted CRC of polynomial 97 is right", Demand::checked},
    Clause{.id = "channel-2",
           .paragraph = "SPI, Channel 2",
           .words = "after AA each cycle of channel 2 has a good CRC and the position of channel 1",
           .demand = Demand::does,
           .needs = "has_ch2=true",
           .command = "alarms"},
    Clause{.id = "channel-3",
           .paragraph = "SPI, Encoder programming",
           .words = "a register that is asked for is answered: idle, busy, ready, its bytes",
           .demand = Demand::does,
           .needs = "has_ch2=true",
           .command = "temperature"},
    Clause{.id = "identity",
           .paragraph = "SPI, Channel 1",
           .words = "the frame after BB carries the identity",
           .demand = Demand::does,
           .command = "identify",
           .shown_with = "resolution=20&multiturn_bits=0"},
};

// ---- Requests that break the clause `access`

namespace script {
constexpr std::chrono::milliseconds pause{1};
constexpr auto keys_again =
    std::array{HostStep{pause, "00 00"}, HostStep{pause, "00 cd"},        HostStep{pause, "00 ef"},
               HostStep{pause, "00 89"}, HostStep{pause, "00 ab"},        HostStep{pause, "00 59"},
               HostStep{pause, "00 00"}, HostStep{pause, "00 02"},        HostStep{pause, "00 00", {}, 3},
               HostStep{pause, "00 10"}, HostStep{pause, "00 00", {}, 2}, HostStep{pause, "00 cd"}};
constexpr auto zeros_and_keys =
    std::array{HostStep{pause, "00 00"}, HostStep{pause, "00 cd"},        HostStep{pause, "00 ef"},
               HostStep{pause, "00 89"}, HostStep{pause, "00 ab"},        HostStep{pause, "00 59"},
               HostStep{pause, "00 00"}, HostStep{pause, "00 02"},        HostStep{pause, "00 00", {}, 3},
               HostStep{pause, "00 10"}, HostStep{pause, "00 00", {}, 3}, HostStep{pause, "00 cd"}};
}  // namespace script

/// Requirements of the EncoLink document that a host on SPI must fulfil.
constexpr std::array<HostClause, 8> spi_host_clauses{{
    {"asks", "SPI, Channel 1", "the first byte of a frame is a command", HostDemand::asks},
    {"silence", "SPI, Channel 1", "after a data line that stayed as it was it asks again", HostDemand::after_silence},
    {"damage", "SPI, Channel 1", "after a damaged frame it asks again", HostDemand::after_damage},
    {"lead", "SPI timing diagram, t_s", "the clock begins 5 us after NCS went low", HostDemand::rule,
     "clock less than 5 us after NCS went low"},
    {"pause", "SPI timing diagram, t_p", "NCS is high for 5 us between two frames", HostDemand::rule,
     "NCS high for less than 5 us"},
    {"speed", "SPI, Communication parameters", "the clock is no faster than 4 MHz", HostDemand::rule,
     "clock faster than 4 MHz"},
    {"mode", "SPI timing diagram", "SCK idles low, and MISO is sampled when it falls", HostDemand::rule, spi_mode_rule},
    {.id = "access",
     .paragraph = "SPI, Encoder programming",
     .words = "a register is not asked for before the last one was answered",
     .demand = HostDemand::rule,
     .rule = "register access before the last one was answered",
     .breaks = {script::keys_again, script::zeros_and_keys}},
}};

/// Requirements of the EncoLink document that a host on a UART must fulfil.
constexpr std::array<HostClause, 4> host_clauses{{
    {"asks", "UART, Channel 1", "requests are two bytes, command and data", HostDemand::asks},
    {"silence", "UART, Channel 1", "after no reply it asks again", HostDemand::after_silence},
    {"damage", "UART, Channel 1", "after a damaged reply it asks again", HostDemand::after_damage},
    {.id = "access",
     .paragraph = "UART, Encoder programming",
     .words = "a register is not asked for before the last one was answered",
     .demand = HostDemand::rule,
     .rule = "register access before the last one was answered",
     .breaks = {script::keys_again, script::zeros_and_keys}},
}};

}  // namespace

constinit const Clauses unit_clauses{clauses, host_clauses};
constinit const Clauses spi_unit_clauses{spi_clauses, spi_host_clauses};

}  // namespace absenc::encolink
