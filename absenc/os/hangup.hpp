// SPDX-License-Identifier: Apache-2.0
// SIGHUP as a descriptor that a program can wait for: the signal asks a service to read its files again.
#pragma once

#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// Returns a descriptor that is readable after SIGHUP; none on Windows, which has no such signal. Call it before other
/// threads are started. Throws Failure.
[[nodiscard]] Descriptor catch_hangups();

/// Takes pending SIGHUPs out of the descriptor. Returns false if none was pending.
bool take_hangup(const Descriptor& hangups);

}  // namespace absenc::os
