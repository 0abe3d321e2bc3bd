// SPDX-License-Identifier: Apache-2.0
// Windows has no signal that asks a program to read its files again.
#include "absenc/os/hangup.hpp"

namespace absenc::os {

Descriptor catch_hangups() { return {}; }

bool take_hangup(const Descriptor&) { return false; }

}  // namespace absenc::os
