// SPDX-License-Identifier: Apache-2.0
// What changes an encoder asks first; scripts say --yes.
#pragma once

#include <string_view>

#include "absenc/client/port/address.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

using namespace client;

/// Whether the user is to be asked before `what`, which means `meaning`. Throws UsageError when nobody is there.
[[nodiscard]] bool must_ask(const Invocation& invocation, const EncoderAddress& uri, std::string_view what,
                            std::string_view meaning);

/// Asks; only y and yes go on, in upper or lower case. Throws os::Interrupted.
[[nodiscard]] bool confirmed(const EncoderAddress& uri, std::string_view meaning);

/// Prints what the command's requests may do to other devices on the line, if anything.
void tell_disturbance(const EncoderAddress& uri, const Command& command);

/// Of a command that changes no encoder: tells what it disturbs, if anything, and asks. False: it is not to be sent.
/// Throws as the above.
[[nodiscard]] bool may_disturb(const Invocation& invocation, const EncoderAddress& uri, const Command& command);

}  // namespace absenc::tool
