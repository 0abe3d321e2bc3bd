// SPDX-License-Identifier: Apache-2.0
// USB devices in /sys.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "absenc/os/error.hpp"
#include "absenc/os/ftdi_usb.hpp"
#include "absenc/os/usb_adapter.hpp"

namespace absenc::os {

/// Returns the identity of the USB device whose folder in /sys is `folder`; missing numbers are 0, as in folders of
/// other things.
[[nodiscard]] UsbAdapter usb_device(const std::filesystem::path& folder);

/// Returns the FTDI chips on USB in the order in which they were plugged in. `sys` and `dev` are parameters for tests.
[[nodiscard]] std::vector<FtdiAdapter> ftdi_adapters(const std::filesystem::path& sys = "/sys/bus/usb/devices",
                                                     const std::filesystem::path& dev = "/dev/bus/usb");

/// Returns the error of a chip that this user may not open; its text names the udev rule.
[[nodiscard]] Failure ftdi_no_permission(const FtdiAdapter& adapter);

/// The chips of this computer as /sys lists them; `open` throws Failure `unsupported`. os/linux/ftdi opens them, so
/// that programs without it need no libftdi.
struct ListedFtdi : FtdiUsb {
  [[nodiscard]] std::vector<FtdiAdapter> adapters() override;
  [[nodiscard]] std::unique_ptr<FtdiChannel> open(const FtdiAdapter& adapter, char channel) override;
};

}  // namespace absenc::os
