// SPDX-License-Identifier: Apache-2.0
// Runs a command of a protocol for any verb: asks the user, runs the command, and prints its result or failure.
#pragma once

#include "absenc/client/encoder/connection.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

using namespace client;

/// Runs one command and prints its result, as the options --yes and --json state; first asks the user if the command
/// changes the encoder; returns the exit status. Throws UsageError if it must ask without a terminal, EncoderFailure,
/// Failure, os::Failure, os::Interrupted.
int run_command(const Invocation& invocation, const EncoderAddress& uri, const Command& command, Arguments arguments);

/// Runs a command of Verb::scan and prints its list of encoders; returns the exit status.
int run_scan_command(const Invocation& invocation, const EncoderAddress& uri, const Command& command,
                     Arguments arguments);

}  // namespace absenc::tool
