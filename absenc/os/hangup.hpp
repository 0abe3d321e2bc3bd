// SPDX-License-Identifier: Apache-2.0
// SIGHUP as something to wait for: by it a service is told to read its files again.
#pragma once

#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// Readable when SIGHUP has come. Call it before other threads are started, which else would be ended by the signal.
/// Throws Failure.
[[nodiscard]] Descriptor catch_hangups();

/// Takes what has come out of it; false when nothing had.
bool take_hangup(const Descriptor& hangups);

}  // namespace absenc::os
