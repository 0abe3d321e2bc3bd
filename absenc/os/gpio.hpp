// SPDX-License-Identifier: Apache-2.0
// Pulses on GPIO lines, for programs that include this header and link absenc::gpio.
#pragma once

namespace absenc::os {

/// Lets ports send pulses on GPIO lines. Returns true.
bool use_gpio();

namespace detail {
inline const bool gpio_in_use = use_gpio();
}  // namespace detail

}  // namespace absenc::os
