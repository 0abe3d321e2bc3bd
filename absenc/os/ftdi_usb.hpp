// SPDX-License-Identifier: Apache-2.0
// FTDI chips on USB: which there are, and one channel of a chip as a stream of commands and replies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/bytes.hpp"
#include "absenc/core/time.hpp"
#include "absenc/os/usb_adapter.hpp"

namespace absenc::os {

/// An FTDI chip that is plugged in.
struct FtdiAdapter {
  std::uint8_t bus = 0;      // number of the USB bus
  std::uint8_t address = 0;  // address of the device on the bus
  UsbAdapter usb{};
  std::string device{};             // path that must be opened to use it: "/dev/bus/usb/001/005"
  std::string refusal{};            // reason why this user cannot open it; "" if none is known
  std::uint8_t channels = 0;        // number of channels with an MPSSE: 0 of chips without one
  std::uint32_t base = 60'000'000;  // fastest base clock of the MPSSE, in Hz

  /// Returns the adapter in words: "FT232H (serial number FT1ABC)".
  [[nodiscard]] std::string words() const;
};

/// A place "SERIAL/B" in parts: the serial number, "" for the only adapter there is, and the channel.
struct FtdiPlace {
  std::string serial{};
  char channel = 'A';
};

/// Returns the parts of `text`: "", "SERIAL", "SERIAL/B" or "/B". Throws Failure `unsupported` if the channel is none.
[[nodiscard]] FtdiPlace ftdi_place(std::string_view text);

/// Sets what is known about the chip of `adapter.usb`: its number of channels with an MPSSE, and its base clock.
void describe_chip(FtdiAdapter& adapter);

/// A channel of a chip whose MPSSE is on. Its pins are inputs, which rest high, until the first command.
struct FtdiChannel {
  virtual ~FtdiChannel() = default;
  /// Sends all of `commands`. Throws Failure.
  virtual void write(Bytes commands) = 0;
  /// Reads replies into `into` and returns their number; 0 if the chip has none for some milliseconds. Throws
  /// Failure.
  [[nodiscard]] virtual std::size_t read(MutableBytes into) = 0;
};

/// The chips of this computer, which tests replace.
struct FtdiUsb {
  virtual ~FtdiUsb() = default;
  /// Returns the FTDI chips that are plugged in; opens none.
  [[nodiscard]] virtual std::vector<FtdiAdapter> adapters() = 0;
  /// Opens a channel and switches its MPSSE on. The kernel's driver of serial ports has the channel again afterwards.
  /// Throws Failure.
  [[nodiscard]] virtual std::unique_ptr<FtdiChannel> open(const FtdiAdapter& adapter, char channel) = 0;
};
[[nodiscard]] FtdiUsb& system_ftdi();
/// Replaces the result of `system_ftdi` by `usb`, which must outlive all ports. Call it before threads are started.
void set_system_ftdi(FtdiUsb& usb);

/// Returns the adapter that `place` names. Throws Failure, whose text says which adapters there are.
[[nodiscard]] FtdiAdapter find_ftdi(FtdiUsb& usb, const FtdiPlace& place);

}  // namespace absenc::os
