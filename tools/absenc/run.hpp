// SPDX-License-Identifier: Apache-2.0
// What every verb that runs commands of a protocol does: ask, run, show the result or the failure.
#pragma once

#include <stdexcept>

#include "tools/absenc/encoder.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// A command of the encoder failed; main.cpp shows it as --json asks for.
struct CommandFailure : std::runtime_error {
  explicit CommandFailure(Trouble what_failed)
      : std::runtime_error(what_failed.text()), trouble(std::move(what_failed)) {}
  Trouble trouble;
};

/// One command with everything around it. Heeds --yes and --json; returns the exit status. Throws UsageError when
/// nobody can be asked, CommandFailure.
int run_command(const Invocation& invocation, const EncoderUri& uri, const Command& command, Arguments arguments);

/// A command of Verb::scan, whose report is a list.
int run_scan_command(const Invocation& invocation, const EncoderUri& uri, const Command& command, Arguments arguments);

/// Only the command; `sink` gets its fields. Throws CommandFailure.
void run_into(Encoder& encoder, const Command& command, Arguments arguments, FieldSink& sink);

}  // namespace absenc::tool
