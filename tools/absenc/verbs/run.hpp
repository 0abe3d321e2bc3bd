// SPDX-License-Identifier: Apache-2.0
// Runs a command of a protocol for any verb: asks, runs, prints the result or the failure.
#pragma once

#include "absenc/client/encoder/connection.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

using namespace client;

/// Asks, runs one command and prints its result, with --yes and --json; returns the exit status. Throws UsageError
/// without a terminal, EncoderFailure.
int run_command(const Invocation& invocation, const EncoderAddress& uri, const Command& command, Arguments arguments);

/// Runs a command of Verb::scan, whose result is a list.
int run_scan_command(const Invocation& invocation, const EncoderAddress& uri, const Command& command,
                     Arguments arguments);

}  // namespace absenc::tool
