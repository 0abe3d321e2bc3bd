// SPDX-License-Identifier: Apache-2.0
// One request to a virtual encoder and its reply, in virtual time.
#pragma once

#include "absenc/client/port/runner.hpp"

namespace absenc::client {

/// Runs a command on a new virtual encoder of the address and returns the result. Throws UsageError.
[[nodiscard]] Attempted answer_of(const EncoderAddress& address, const Command& command, Arguments arguments);

}  // namespace absenc::client
