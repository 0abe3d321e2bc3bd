// SPDX-License-Identifier: Apache-2.0
// Properties of a serial port that Linux reports.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace absenc::os {

/// Numbers of breaks, and of damaged or lost characters, that a UART has counted since it was initialised.
struct LineCounts {
  std::uint64_t breaks = 0;   // number of breaks: the line was low for longer than a character
  std::uint64_t framing = 0;  // number of characters without a stop bit
  std::uint64_t parity = 0;
  std::uint64_t overruns = 0;  // characters lost because the computer was too slow

  [[nodiscard]] LineCounts since(const LineCounts& before) const {
    return {breaks - before.breaks, framing - before.framing, parity - before.parity, overruns - before.overruns};
  }
};

/// Properties of a serial port; unknown ones are empty.
struct PortFacts {
  std::string driver{};                     // name of the driver, for example "ftdi_sio", "serial8250"
  std::optional<unsigned> latency_timer{};  // time for which a USB adapter holds back received bytes, in milliseconds
  std::optional<bool> kernel_direction{};   // whether the kernel switches an RS-485 transceiver
  std::optional<LineCounts> counts{};
  bool pseudo_terminal = false;  // whether the port is a pseudo-terminal, which has no line and so no rate
};

/// Returns the properties of the port at `path`, as far as they are known.
[[nodiscard]] PortFacts port_facts(const std::string& path, const std::filesystem::path& sys = "/sys/class/tty");

/// Returns whether `driver` is known as a driver of mobile modems, whose ports lead to no serial line.
[[nodiscard]] bool is_modem_driver(const std::string& driver);
/// Returns whether `driver` is known as a driver of built-in UARTs.
[[nodiscard]] bool is_bare_uart(const std::string& driver);

}  // namespace absenc::os
