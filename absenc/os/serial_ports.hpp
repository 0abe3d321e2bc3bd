// SPDX-License-Identifier: Apache-2.0
// What /sys and /proc tell about serial ports: which there are, who holds one, why one does not open.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "absenc/os/error.hpp"
#include "absenc/os/usb_adapter.hpp"

namespace absenc::os {

/// "/dev/ttyUSB0" and so on, sorted: the terminals with hardware behind them. `sys` is a parameter for tests.
[[nodiscard]] std::vector<std::string> serial_ports(const std::filesystem::path& sys = "/sys/class/tty");

/// Milliseconds for which a USB adapter holds back what it has received; empty when it has no such timer.
[[nodiscard]] std::optional<unsigned> latency_timer(const std::string& terminal,
                                                    const std::filesystem::path& sys = "/sys/class/tty");

/// "ftdi_sio", "serial8250"; "" when /sys does not tell.
[[nodiscard]] std::string driver_of(const std::string& terminal, const std::filesystem::path& sys = "/sys/class/tty");

/// The program that holds the port or has it open, as "absenc (process 4711)"; "" when there is none that this user
/// may see.
[[nodiscard]] std::string holder_of(const std::string& path);

/// A port as it can be seen without opening it: an open port raises DTR, which resets some boards.
struct ListedPort {
  std::string path{};
  std::string lasting_path{};  // "/dev/serial/by-id/...", which stays when ports are plugged in in another order; or ""
  std::string driver{};
  std::optional<UsbAdapter> usb{};
  std::optional<unsigned> latency_timer{};      // milliseconds
  std::optional<std::uint32_t> highest_rate{};  // bits a second, of the chip
  std::string refusal{};                        // why this user may not open it; "": may
  std::string holder{};                         // as `holder_of`
};

/// `sys` and `links` are parameters for tests.
[[nodiscard]] ListedPort look_at(const std::string& path, const std::filesystem::path& sys = "/sys/class/tty",
                                 const std::filesystem::path& links = "/dev/serial/by-id");

/// Why `path` did not open, from what open(2), flock(2) or ioctl(2) left in errno, with what to try.
[[nodiscard]] Failure open_failure(const std::string& path, int error);

}  // namespace absenc::os
