// SPDX-License-Identifier: Apache-2.0
// Asks the user before a command changes an encoder or disturbs a bus; --yes answers for scripts.
#pragma once

#include <string_view>

#include "absenc/client/port/address.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

using namespace client;

/// Returns whether the user must be asked before the action `what`, explained by `meaning`. Throws UsageError without a
/// terminal.
[[nodiscard]] bool must_ask(const Invocation& invocation, const EncoderAddress& uri, std::string_view what,
                            std::string_view meaning);

/// Asks the user and returns true for y and yes, in upper or lower case. Throws os::Interrupted.
[[nodiscard]] bool confirmed(const EncoderAddress& uri, std::string_view meaning);

/// Prints how the command's requests may disturb other devices on the line, if they may.
void tell_disturbance(const EncoderAddress& uri, const Command& command);

/// For a command that changes no encoder: prints how it may disturb other devices and asks. Returns false if the user
/// refuses. Throws as must_ask and confirmed do.
[[nodiscard]] bool may_disturb(const Invocation& invocation, const EncoderAddress& uri, const Command& command);

}  // namespace absenc::tool
