// SPDX-License-Identifier: Apache-2.0
// Information from /sys and /proc about serial ports: which exist, which program holds one, why one does not open.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "absenc/os/error.hpp"
#include "absenc/os/usb_adapter.hpp"

namespace absenc::os {

/// Returns the terminals with hardware behind them, "/dev/ttyUSB0" and so on, sorted. `sys` is a parameter for tests.
[[nodiscard]] std::vector<std::string> serial_ports(const std::filesystem::path& sys = "/sys/class/tty");

/// Returns for how many milliseconds a USB adapter holds back received bytes; empty if it has no such timer.
[[nodiscard]] std::optional<unsigned> latency_timer(const std::string& terminal,
                                                    const std::filesystem::path& sys = "/sys/class/tty");

/// Returns the name of the driver of `terminal`, for example "ftdi_sio", "serial8250"; "" if /sys does not state it.
[[nodiscard]] std::string driver_of(const std::string& terminal, const std::filesystem::path& sys = "/sys/class/tty");

/// Returns the program that has locked the port at `path` or, if it is no pseudo-terminal, has it open, for example
/// "absenc serve (process 4711)"; "" if there is none that this user can see.
[[nodiscard]] std::string holder_of(const std::string& path);

/// Properties of a port that can be read without opening it: opening raises DTR, which resets some boards.
struct ListedPort {
  std::string path{};
  // A path "/dev/serial/by-id/...", which stays the same when ports are plugged in in another order; "" if there is
  // none.
  std::string lasting_path{};
  std::string driver{};
  std::optional<UsbAdapter> usb{};
  std::optional<unsigned> latency_timer{};  // time for which a USB adapter holds back received bytes, in milliseconds
  // Highest bit rate of the adapter's chip or of the UART's clock, in bits per second; empty if unknown.
  std::optional<std::uint32_t> highest_rate{};
  std::string refusal{};  // reason why this user may not open the port; "" if the user may
  std::string holder{};   // program that uses the port, as returned by `holder_of`
};

/// Reads the properties of the port at `path`. `sys` and `links` are parameters for tests.
[[nodiscard]] ListedPort inspect_port(const std::string& path, const std::filesystem::path& sys = "/sys/class/tty",
                                      const std::filesystem::path& links = "/dev/serial/by-id");

/// Returns a Failure that explains why `path` did not open, with what to try. `error`: the value of errno.
[[nodiscard]] Failure open_failure(const std::string& path, int error);

}  // namespace absenc::os
