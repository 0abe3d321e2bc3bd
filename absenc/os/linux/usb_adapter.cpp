// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/usb_adapter.hpp"

#include "absenc/os/linux/sys_file.hpp"
#include "absenc/os/linux/usb_device.hpp"

namespace absenc::os {

namespace {

namespace fs = std::filesystem;

// Returns the hexadecimal number in the file at `path`, at most 16 bits; 0 if the file has none.
std::uint16_t number_of(const fs::path& path) { return static_cast<std::uint16_t>(first_number(path, 16).value_or(0)); }

}  // namespace

UsbAdapter usb_device(const fs::path& folder) {
  return {number_of(folder / "idVendor"),      number_of(folder / "idProduct"), number_of(folder / "bcdDevice"),
          first_line(folder / "manufacturer"), first_line(folder / "product"),  first_line(folder / "serial")};
}

std::optional<UsbAdapter> usb_adapter(const std::string& terminal, const fs::path& sys) {
  std::error_code error;
  fs::path folder = fs::canonical(sys / terminal / "device", error);
  if (error) return std::nullopt;
  // Only the USB device, above the terminal's interface, has an idVendor.
  for (; folder.has_relative_path(); folder = folder.parent_path()) {
    if (!fs::exists(folder / "idVendor", error)) continue;
    return usb_device(folder);
  }
  return std::nullopt;
}

}  // namespace absenc::os
