// SPDX-License-Identifier: Apache-2.0
// One request to a virtual encoder and its reply, in virtual time.
#pragma once

#include "absenc/client/port/runner.hpp"

namespace absenc::client {

/// Runs a command once with the virtual encoder of this address, and returns its last request with the reply. Throws
/// UsageError for settings that the encoder cannot have.
[[nodiscard]] Attempted answer_of(const EncoderAddress& address, const Command& command, Arguments arguments);

}  // namespace absenc::client
