// SPDX-License-Identifier: Apache-2.0
// A serial port of Linux: UARTs, USB adapters, and pseudo-terminals, which virtual encoders offer.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absenc/link/line.hpp"
#include "absenc/os/pulse_wire.hpp"
#include "absenc/os/serial_ports.hpp"
#include "absenc/os/serial_settings.hpp"
#include "absenc/os/stream_port.hpp"

namespace absenc::os {

/// Who switches an RS-485 transceiver to sending.
enum class Rs485 : std::uint8_t {
  automatic,  // the kernel with RTS where the port can and RTS is free, otherwise the adapter; for half-duplex lines
  on,         // the kernel; a port that cannot is an error
  off,        // not the kernel; for full-duplex lines
};

/// Whether a port is to send at all.
enum class SerialUse : std::uint8_t {
  both,
  receive,  // it is opened without writing, so that nothing can be sent; RTS, by which some adapters send, is released
};

/// Whether characters take no time there, and any rate does.
[[nodiscard]] bool is_pseudo_terminal(const std::string& path);

/// Raw, 8 data bits. Locked against other programs; the previous settings come back when it is closed.
class SerialPort final : public DescriptorPort {
 public:
  /// What came before is discarded. Throws Failure of every kind but `lost`; `bad_rate` when the port's nearest rate
  /// is more than 1 % away. A pulse without its wire in `wires` is `unsupported`. `kernel` must outlive the port.
  SerialPort(const std::string& path, const LineSettings& settings, Rs485 rs485 = Rs485::automatic,
             const PulseWires& wires = {}, WireKernel& kernel = system_wires(), SerialUse use = SerialUse::both);
  ~SerialPort() override;

  /// What could be better about this port, one sentence each, with the remedy.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  /// Whether the kernel switches the direction.
  [[nodiscard]] bool kernel_direction() const { return kernel_direction_; }

 private:
  void drive(ExtraWire wire, bool active) override;
  [[nodiscard]] Time pulse_width(ExtraWire wire, Time asked) const override;
  void change_rate(std::uint32_t rate) override;

  [[nodiscard]] const std::optional<PulseOutput>& pulse_output(ExtraWire wire) const {
    return wire == ExtraWire::trigger ? trigger_ : clear_;
  }
  void apply(const LineSettings& settings);
  void lock() const;
  void set_direction(Rs485 rs485);
  void take_wires(const PulseWires& wires, WireKernel& kernel);
  void shorten_latency();
  [[nodiscard]] std::uint32_t clock_of_rates() const;

  std::string path_;
  bool pseudo_ = false;
  bool kernel_direction_ = false;
  TerminalState before_{};
  LineSettings line_{};
  std::optional<PulseOutput> trigger_;
  std::optional<PulseOutput> clear_;
  std::vector<std::string> notes_;
};

}  // namespace absenc::os
