// SPDX-License-Identifier: Apache-2.0
// Standard input as an object that a wait can watch.
#pragma once

#include "absenc/os/windows/waitable.hpp"

namespace absenc::os {

/// Returns standard input: a console, a pipe or a file. From the first call on a thread reads it, because Windows has
/// no wait for all three.
[[nodiscard]] Waitable& standard_input();

}  // namespace absenc::os
