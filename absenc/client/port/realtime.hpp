// SPDX-License-Identifier: Apache-2.0
// The setting `realtime` of an address: its port is used by real-time threads only.
#pragma once

#include <span>

#include "absenc/client/port/address.hpp"

namespace absenc::client {

/// Makes the calling thread a real-time thread of at least `priority`; 0: does nothing. Throws Failure, which unlike
/// os::Failure does not count as the loss of a port.
void require_realtime(int priority);

/// Checks that threads may have the highest priority of these addresses. The calling thread stays as it is. Throws
/// Failure.
void check_realtime(std::span<const EncoderAddress> encoders);

}  // namespace absenc::client
