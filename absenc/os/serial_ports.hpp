// SPDX-License-Identifier: Apache-2.0
// What /sys and /proc tell about serial ports: which there are, who holds one, why one does not open.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "absenc/os/error.hpp"

namespace absenc::os {

/// "/dev/ttyUSB0" and so on, sorted: the terminals with hardware behind them. `sys` is a parameter for tests.
[[nodiscard]] std::vector<std::string> serial_ports(const std::filesystem::path& sys = "/sys/class/tty");

/// Milliseconds for which a USB adapter holds back what it has received; empty when it has no such timer.
[[nodiscard]] std::optional<unsigned> latency_timer(const std::string& terminal,
                                                    const std::filesystem::path& sys = "/sys/class/tty");

/// Why `path` did not open, from what open(2), flock(2) or ioctl(2) left in errno, with what to try.
[[nodiscard]] Failure open_failure(const std::string& path, int error);

}  // namespace absenc::os
