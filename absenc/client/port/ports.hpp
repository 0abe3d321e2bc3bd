// SPDX-License-Identifier: Apache-2.0
// Lists the ports of this computer to which an encoder may be connected.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "absenc/os/serial_ports.hpp"

namespace absenc::client {

struct FoundPort {
  std::string path{};       // path or name of the port: "/dev/ttyUSB0", "can0", "/dev/spidev0.0"
  std::string_view kind{};  // kind of the port: "serial", "can" or "spi"
  os::ListedPort serial{};  // details of a serial port; empty for other kinds

  /// Returns the command that the user can run next, "absenc identify /dev/ttyUSB0"; "" for a port that may not be
  /// opened, is in use, or belongs to a mobile modem.
  [[nodiscard]] std::string next_command() const;
};

/// Returns all ports of this computer without opening any, because opening would reset some boards.
[[nodiscard]] std::vector<FoundPort> ports();

/// Converts the port to {"port","kind"}; for a serial port also "lasting_name","maker","adapter","serial_number",
/// "chip","driver","latency_timer_ms","highest_rate","may_open","refusal","in_use_by". Unknown values are null.
[[nodiscard]] Json to_json(const FoundPort& port);

}  // namespace absenc::client
