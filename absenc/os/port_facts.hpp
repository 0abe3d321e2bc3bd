// SPDX-License-Identifier: Apache-2.0
// What Linux tells of a serial port besides its bytes: which driver it has, how long it holds bytes back, and which
// damaged characters its UART has counted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace absenc::os {

/// Of the UART, since it was made.
struct LineCounts {
  std::uint64_t breaks = 0;   // the line stayed low for more than a character
  std::uint64_t framing = 0;  // no stop bit where it should be
  std::uint64_t parity = 0;
  std::uint64_t overruns = 0;  // the computer was too slow

  [[nodiscard]] LineCounts since(const LineCounts& before) const {
    return {breaks - before.breaks, framing - before.framing, parity - before.parity, overruns - before.overruns};
  }
};

/// What is not known is empty.
struct PortFacts {
  std::string driver{};                     // "ftdi_sio", "serial8250"
  std::optional<unsigned> latency_timer{};  // milliseconds
  std::optional<bool> kernel_direction{};   // whether the kernel switches an RS-485 transceiver
  std::optional<LineCounts> counts{};
  bool pseudo_terminal = false;  // it has no line, and so no rate
};

/// Of the port at `path`, which nobody should have open: what its driver tells is left out else. `sys` is a parameter
/// for tests.
[[nodiscard]] PortFacts port_facts(const std::string& path, const std::filesystem::path& sys = "/sys/class/tty");

/// Whether such a driver is that of a mobile modem, behind whose ports no line is.
[[nodiscard]] bool is_modem_driver(const std::string& driver);
/// Whether it is that of a UART of the computer itself, which has no transceiver that switches by itself.
[[nodiscard]] bool is_bare_uart(const std::string& driver);

}  // namespace absenc::os
