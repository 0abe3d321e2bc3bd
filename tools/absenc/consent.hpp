// SPDX-License-Identifier: Apache-2.0
// Asks the user, unless --yes or sim: makes it unnecessary, before a command changes an encoder or disturbs a bus.
#pragma once

#include <string_view>

#include "absenc/client/port/address.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

using namespace client;

/// Returns whether the user must be asked to confirm the action `what`. Throws UsageError if the user must be asked,
/// but nobody can answer.
[[nodiscard]] bool must_ask(const Invocation& invocation, const EncoderAddress& uri, std::string_view what,
                            std::string_view meaning);

/// Asks the user to confirm, and returns whether the answer was y or yes. Throws os::Interrupted.
[[nodiscard]] bool confirmed(const EncoderAddress& uri, std::string_view meaning);

/// Prints how the requests of `command` may disturb other devices on a real line; prints nothing if they cannot.
void tell_disturbance(const EncoderAddress& uri, const Command& command);

/// Returns whether `command` may be run. Asks the user first if it may disturb other devices. Throws UsageError,
/// os::Interrupted.
[[nodiscard]] bool may_disturb(const Invocation& invocation, const EncoderAddress& uri, const Command& command);

}  // namespace absenc::tool
