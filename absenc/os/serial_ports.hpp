// SPDX-License-Identifier: Apache-2.0
// Information from /sys and /proc about serial ports.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "absenc/os/error.hpp"
#include "absenc/os/usb_adapter.hpp"

namespace absenc::os {

/// Returns the paths of all terminals with hardware behind them, "/dev/ttyUSB0" and so on, sorted.
[[nodiscard]] std::vector<std::string> serial_ports(const std::filesystem::path& sys = "/sys/class/tty");

/// Returns for how many milliseconds a USB adapter holds back received bytes; empty if unknown.
[[nodiscard]] std::optional<unsigned> latency_timer(const std::string& terminal,
                                                    const std::filesystem::path& sys = "/sys/class/tty");

/// Returns the name of the driver of `terminal` ("ttyUSB0"), for example "ftdi_sio"; "" if unknown.
[[nodiscard]] std::string driver_of(const std::string& terminal, const std::filesystem::path& sys = "/sys/class/tty");

/// Returns the program that holds the port at `path`, for example "absenc serve (process 4711)"; "" if none is found.
[[nodiscard]] std::string holder_of(const std::string& path);

/// Properties of a serial port that are read without opening the port: opening may reset a board.
struct ListedPort {
  std::string path{};
  // path "/dev/serial/by-id/...", which does not depend on the order of ports; "" if none
  std::string lasting_path{};
  std::string driver{};
  std::optional<UsbAdapter> usb{};
  std::optional<unsigned> latency_timer{};  // time for which a USB adapter holds back received bytes, in milliseconds
  // highest bit rate of the adapter or the UART, in bits per second; empty if unknown
  std::optional<std::uint32_t> highest_rate{};
  std::string refusal{};  // reason why this user cannot open the port; "" if none is known
  std::string holder{};   // program that uses the port, as returned by `holder_of`
};

/// Reads the properties of the port at `path`. `sys` and `links` are parameters for tests.
[[nodiscard]] ListedPort inspect_port(const std::string& path, const std::filesystem::path& sys = "/sys/class/tty",
                                      const std::filesystem::path& links = "/dev/serial/by-id");

/// Returns a Failure that explains why `path` did not open. `error`: the value of errno.
[[nodiscard]] Failure open_failure(const std::string& path, int error);

}  // namespace absenc::os
