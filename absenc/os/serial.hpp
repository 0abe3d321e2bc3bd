// SPDX-License-Identifier: Apache-2.0
// A serial port of Linux: UARTs, USB adapters, and pseudo-terminals, which virtual encoders offer.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absenc/link/line.hpp"
#include "absenc/os/serial_ports.hpp"
#include "absenc/os/serial_settings.hpp"
#include "absenc/os/stream_port.hpp"

namespace absenc::os {

/// Who switches an RS-485 transceiver to sending.
enum class Rs485 : std::uint8_t {
  automatic,  // the kernel with RTS where the port can, otherwise the adapter by itself; for half-duplex lines
  on,         // the kernel; a port that cannot is an error
  off,        // not the kernel; for full-duplex lines
};

/// Raw, 8 data bits. Locked against other programs; the previous settings come back when it is closed.
/// The lines: `trigger` is RTS, `clear` is DTR.
class SerialPort final : public DescriptorPort {
 public:
  /// What came before is discarded. Throws Failure of every kind but `lost`; `bad_rate` when the port's nearest rate
  /// is more than 1 % away.
  SerialPort(const std::string& path, const LineSettings& settings, Rs485 rs485 = Rs485::automatic);
  ~SerialPort() override;

  /// What could be better about this port, one sentence each, with the remedy.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  /// Whether the kernel switches the direction.
  [[nodiscard]] bool kernel_direction() const { return kernel_direction_; }

 private:
  void drive(Line line, bool active) override;
  void apply(const LineSettings& settings) override;

  void lock() const;
  void set_direction(Rs485 rs485);
  void shorten_latency();
  [[nodiscard]] std::uint32_t clock_of_rates() const;

  std::string path_;
  bool pseudo_ = false;
  bool kernel_direction_ = false;
  TerminalState before_{};
  std::vector<std::string> notes_;
};

}  // namespace absenc::os
