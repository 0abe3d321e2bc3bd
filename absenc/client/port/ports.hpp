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
  std::string path{};       // path or name of the port: "/dev/ttyUSB0", "can0", "/dev/spidev0.0", "ftdi:FT1ABC"
  std::string_view kind{};  // kind of the port: "serial", "can", "spi" or "ftdi"
  // details of a serial port, or of an FTDI chip that can clock an encoder; empty for other kinds of ports
  os::ListedPort serial{};

  /// Returns the command of absenc that may help with the port, as "absenc identify /dev/ttyUSB0"; may be "".
  [[nodiscard]] std::string next_command() const;
};

/// Returns the ports of this computer; opens none, because opening would reset some boards.
[[nodiscard]] std::vector<FoundPort> ports();

/// Returns the port as a JSON object; unknown details of a serial port are null.
[[nodiscard]] Json to_json(const FoundPort& port);

}  // namespace absenc::client
