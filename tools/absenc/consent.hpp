// SPDX-License-Identifier: Apache-2.0
// Asks the user before a command changes an encoder or disturbs a bus; the option --yes answers for scripts.
#pragma once

#include <string_view>

#include "absenc/client/port/address.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

using namespace client;

/// Returns whether the user must be asked before the action `what`, explained by `meaning`; false with --yes and for
/// sim: encoders. Throws UsageError if a question is needed but no terminal is available.
[[nodiscard]] bool must_ask(const Invocation& invocation, const EncoderAddress& uri, std::string_view what,
                            std::string_view meaning);

/// Asks the user to confirm, and returns true for the answers y and yes, in upper or lower case. Throws
/// os::Interrupted.
[[nodiscard]] bool confirmed(const EncoderAddress& uri, std::string_view meaning);

/// Prints how the requests of `command` may disturb other devices on the line; prints nothing if they cannot.
void tell_disturbance(const EncoderAddress& uri, const Command& command);

/// For a command that changes no encoder: prints how it may disturb other devices, and asks if necessary. Returns false
/// if the user refuses. Throws UsageError, os::Interrupted.
[[nodiscard]] bool may_disturb(const Invocation& invocation, const EncoderAddress& uri, const Command& command);

}  // namespace absenc::tool
