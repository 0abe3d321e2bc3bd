// SPDX-License-Identifier: Apache-2.0
// The identity of a USB adapter, and the highest rate of its chip.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace absenc::os {

/// Identity of a USB adapter from its USB descriptors; missing texts are empty, numbers 0.
struct UsbAdapter {
  std::uint16_t vendor = 0;     // vendor number, from idVendor
  std::uint16_t product = 0;    // product number, from idProduct
  std::uint16_t release = 0;    // release number bcdDevice, which distinguishes chips with the same product number
  std::string maker{};          // manufacturer's name, from iManufacturer
  std::string name{};           // product name, from iProduct
  std::string serial_number{};  // serial number, from iSerialNumber
};

/// A bridge chip between USB and UART.
struct AdapterChip {
  std::string_view name;       // name of the chip, for example "FT232R"
  std::uint32_t highest_rate;  // highest rate in bits per second, from the chip's data sheet
};

/// Returns the identity of the adapter behind a terminal ("ttyUSB0"); empty if it is not on USB.
[[nodiscard]] std::optional<UsbAdapter> usb_adapter(const std::string& terminal,
                                                    const std::filesystem::path& sys = "/sys/class/tty");

/// Returns the chip of `adapter`, or null if it is none of the known chips.
[[nodiscard]] const AdapterChip* chip_of(const UsbAdapter& adapter);

}  // namespace absenc::os
