// SPDX-License-Identifier: Apache-2.0
// The ports of this computer behind which an encoder may be.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "absenc/os/serial_ports.hpp"

namespace absenc::client {

struct Port {
  std::string path{};       // "/dev/ttyUSB0", "can0", "/dev/spidev0.0"
  std::string_view kind{};  // "serial", "can", "spi"
  os::ListedPort serial{};  // of a serial one

  /// "absenc identify /dev/ttyUSB0"; "" where nobody can be asked behind it: it may not be opened, is in use, or is a
  /// mobile modem.
  [[nodiscard]] std::string next_command() const;
};

/// All of them, without opening any: that would reset some boards.
[[nodiscard]] std::vector<Port> ports();

/// {"port","kind"}, of a serial one also "lasting_name","maker","adapter","serial_number","chip","driver",
/// "latency_timer_ms","highest_rate","may_open","refusal","in_use_by", null where it is not known.
[[nodiscard]] Json to_json(const Port& port);

}  // namespace absenc::client
