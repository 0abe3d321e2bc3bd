// SPDX-License-Identifier: Apache-2.0
// What every verb that runs one command of a protocol does: ask, run, show the result or the failure.
#pragma once

#include "tools/absenc/encoder_uri.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// Heeds --yes and --json; returns the exit status. Throws UsageError when nobody can be asked.
int run_command(const Invocation& invocation, const EncoderUri& uri, const Command& command, Arguments arguments);

}  // namespace absenc::tool
