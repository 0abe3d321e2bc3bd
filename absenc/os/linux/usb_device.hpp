// SPDX-License-Identifier: Apache-2.0
// USB devices in /sys.
#pragma once

#include <filesystem>
#include <vector>

#include "absenc/os/ftdi.hpp"
#include "absenc/os/usb_adapter.hpp"

namespace absenc::os {

/// Returns the identity of the USB device whose folder in /sys is `folder`; missing numbers are 0, as in folders of
/// other things.
[[nodiscard]] UsbAdapter usb_device(const std::filesystem::path& folder);

/// Returns the FTDI chips on USB in the order in which they were plugged in. `sys` and `dev` are parameters for tests.
[[nodiscard]] std::vector<FtdiAdapter> ftdi_adapters(const std::filesystem::path& sys = "/sys/bus/usb/devices",
                                                     const std::filesystem::path& dev = "/dev/bus/usb");

}  // namespace absenc::os
