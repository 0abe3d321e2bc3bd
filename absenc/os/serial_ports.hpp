// SPDX-License-Identifier: Apache-2.0
// Serial ports as the system lists them; Linux: in /sys and /proc.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/os/error.hpp"
#include "absenc/os/usb_adapter.hpp"

namespace absenc::os {

/// Returns the paths of all serial ports with hardware behind them, "/dev/ttyUSB0" or "COM3" and so on, sorted. `sys`
/// is a parameter for tests on Linux here and below; other systems ignore it.
[[nodiscard]] std::vector<std::string> serial_ports(const std::filesystem::path& sys = "/sys/class/tty");

/// Returns whether `place` is written as only serial ports are: with a '/' on Linux, "COM5" on Windows.
[[nodiscard]] bool is_written_as_port(std::string_view place);

/// Returns the port that a user means by `name`: "/dev/ttyUSB0" for "ttyUSB0", "COM5" for "com5"; "" if it is none.
[[nodiscard]] std::string port_named(std::string_view name);

/// Returns a name that serial ports have here, for examples: "/dev/ttyUSB0" and "COM3" for `which` 0.
[[nodiscard]] std::string example_port(unsigned which = 0);

/// Returns how to shorten the latency timer of `terminal` to 1 ms, in words.
[[nodiscard]] std::string way_to_shorter_latency(const std::string& terminal);

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
