// SPDX-License-Identifier: Apache-2.0
// Runs a command of a protocol for any verb, and prints its result.
#pragma once

#include "absenc/client/encoder/connection.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

using namespace client;

/// Runs a command, asks first if it changes an encoder, and prints its result. Returns the exit status.
int run_command(const Invocation& invocation, const EncoderAddress& uri, const Command& command, Arguments arguments);

/// Runs a command of Verb::scan and prints its list of encoders; returns the exit status.
int run_scan_command(const Invocation& invocation, const EncoderAddress& uri, const Command& command,
                     Arguments arguments);

}  // namespace absenc::tool
