// SPDX-License-Identifier: Apache-2.0
// Parameters that many subcommands share, so that their help is the same everywhere.
#pragma once

#include "tools/absenc/subcommand.hpp"

namespace absenc::tool::parameter {

inline constexpr Parameter encoder{"encoder", "",
                                   "PROTOCOL:PORT, PROTOCOL:tcp:HOST:PORT, sim:PROTOCOL or a name from absenc.toml, "
                                   "with ?NAME=VALUE&NAME=VALUE behind it",
                                   "", true};
inline constexpr Parameter option{
    "--option", "NAME=VALUE", "sets an option of the protocol or of the port, as behind the encoder", "", false, true};
/// The option --command of verbs that read repeatedly.
inline constexpr Parameter read_command{
    "--command", "COMMAND", "what to read, instead of the position with all alarms: a command that yields positions"};
/// The option --realtime of verbs that read repeatedly.
inline constexpr Parameter realtime{
    "--realtime", "PRIORITY",
    "read in a real-time thread (SCHED_FIFO) of this priority, 1 to 99, with the memory of the program locked; an "
    "error if the kernel refuses"};
inline constexpr Parameter yes{"--yes", "", "do not ask before the encoder is changed"};
inline constexpr Parameter force{"--force", "", "write also what the protocol protects, as calibration"};
inline constexpr Parameter json{"--json", "", "one JSON object"};

// The parameters `protocol`, `model` and `protocol_option` are for verbs that need no encoder.
inline constexpr Parameter protocol{"protocol", "", "see `absenc list`", "", true};
inline constexpr Parameter model{"--model", "NAME", "which model of the protocol",
                                 "the first that agrees with the options"};
inline constexpr Parameter protocol_option{"--option", "NAME=VALUE", "sets an option of the protocol", "", false, true};

// The parameters `command` and `arguments` name a command of a protocol and its arguments.
inline constexpr Parameter command{"command", "", "a command of the protocol: see `absenc list <protocol>`", "", true};
inline constexpr Parameter arguments{
    "arguments", "", "those of the command: decimal numbers, or hexadecimal with 0x", "", false, true};

}  // namespace absenc::tool::parameter
