// SPDX-License-Identifier: Apache-2.0
// The clock of an FTDI chip, for programs that include this header and link absenc::ftdi.
#pragma once

namespace absenc::os {

/// Lets ports open FTDI chips. Returns true.
bool use_ftdi();

namespace detail {
inline const bool ftdi_in_use = use_ftdi();
}  // namespace detail

}  // namespace absenc::os
