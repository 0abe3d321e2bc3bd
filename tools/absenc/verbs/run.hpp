// SPDX-License-Identifier: Apache-2.0
// What every verb that runs commands of a protocol does: ask, run, show the result or the failure.
#pragma once

#include "absenc/client/encoder/connection.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

using namespace client;

/// One command with everything around it. Heeds --yes and --json; returns the exit status. Throws UsageError when
/// nobody can be asked, EncoderFailure.
int run_command(const Invocation& invocation, const EncoderAddress& uri, const Command& command, Arguments arguments);

/// A command of Verb::scan, whose report is a list.
int run_scan_command(const Invocation& invocation, const EncoderAddress& uri, const Command& command,
                     Arguments arguments);

}  // namespace absenc::tool
