// SPDX-License-Identifier: Apache-2.0
// A serial port: UARTs, USB adapters, and pseudo-terminals of virtual encoders.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/link/line.hpp"
#include "absenc/os/pulse_wire.hpp"
#include "absenc/os/serial_ports.hpp"
#include "absenc/os/serial_settings.hpp"
#include "absenc/os/stream_port.hpp"

namespace absenc::os {

/// Selects the component that switches an RS-485 transceiver to sending.
enum class Rs485 : std::uint8_t {
  // The kernel switches the transceiver with RTS if it can and RTS carries no pulses; else the adapter must switch
  // it.
  automatic,
  on,   // the kernel switches the transceiver; opening throws `unsupported` if the port cannot do it
  off,  // the kernel never switches the transceiver; for full-duplex lines
  // The port itself sets RTS before it sends, and clears it when the last character has left; for drivers that cannot
  // do it. Opening throws `unsupported` if the port has no RTS.
  rts,
};
/// Names of the values, in their order, as an address has them.
inline constexpr std::array<std::string_view, 4> rs485_names{"auto", "on", "off", "rts"};

/// Directions in which a port is used.
enum class SerialUse : std::uint8_t {
  both,
  receive,  // the port is opened for reading only, with RTS released
};

/// Returns whether `path` is a pseudo-terminal, where characters take no time.
[[nodiscard]] bool is_pseudo_terminal(const std::string& path);

/// A serial port in raw mode, locked against other programs.
class SerialPort final : public DescriptorPort {
 public:
  /// Opens `path` and discards bytes received before. Throws Failure. `kernel` must outlive the port.
  SerialPort(const std::string& path, const LineSettings& settings, Rs485 rs485 = Rs485::automatic,
             const PulseWires& wires = {}, WireKernel& kernel = system_wires(), SerialUse use = SerialUse::both);
  ~SerialPort() override;

  /// Returns sentences about settings of this port that could be better, each with the remedy.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  /// Returns whether this port has made the kernel switch the transceiver's direction.
  [[nodiscard]] bool kernel_direction() const { return kernel_direction_; }

 private:
  void drive(ExtraWire wire, bool active) override;
  [[nodiscard]] Time pulse_width(ExtraWire wire, Time requested) const override;
  void change_rate(std::uint32_t rate) override;
  void write_all(Bytes bytes) override;

  [[nodiscard]] const std::optional<PulseOutput>& pulse_output(ExtraWire wire) const {
    return wire == ExtraWire::trigger ? trigger_ : clear_;
  }
  /// Returns whether RTS carries a pulse. Throws Failure if RTS is to switch the direction, too.
  [[nodiscard]] static bool uses_rts(const PulseWires& wires, Rs485 rs485);
  void apply(const LineSettings& settings);
  /// Returns whether the port is the device's end of a USB cable, which has no line and accepts any rate.
  [[nodiscard]] bool is_gadget() const;
  /// Returns the end of the error for a rate that the driver has refused: which rate it set, and what to try.
  [[nodiscard]] std::string rate_instead(std::uint32_t requested, std::uint32_t given) const;
  void lock() const;
  /// Makes the driver switch the direction as `rs485` says.
  void set_direction(Rs485 rs485);
  /// Sets RTS before and clears it after each write, by `kernel`. Throws Failure if the port has no RTS.
  void switch_by_rts(WireKernel& kernel);
  /// Waits until the driver reports that it has sent all bytes.
  void wait_until_sent();
  void take_wires(const PulseWires& wires, WireKernel& kernel);
  void shorten_latency();

  std::string path_;
  bool pseudo_ = false;
  bool kernel_direction_ = false;
  WireKernel* rts_ = nullptr;  // sets RTS before and clears it after each write; null: nothing does
  TerminalState before_{};
  LineSettings line_{};
  std::optional<PulseOutput> trigger_;
  std::optional<PulseOutput> clear_;
  std::vector<std::string> notes_;
};

}  // namespace absenc::os
