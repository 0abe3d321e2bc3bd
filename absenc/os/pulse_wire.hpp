// SPDX-License-Identifier: Apache-2.0
// Wires beside the data that a host pulses: RTS or DTR of the serial port, or a GPIO line of the board.
#pragma once

#include <optional>
#include <string>

#include "absenc/core/time.hpp"

struct gpiod_line;

namespace absenc::os {

/// Which wire it is. Levels are those of a UART's own pins, where RTS and DTR are low while they are set; a driver of
/// RS-232 turns them over. They are pulsed only where the user names them: opening a port sets both.
struct PulseWire {
  enum class Kind { none, rts, dtr, gpio } kind = Kind::none;
  std::string name{};           // gpio: as `gpioinfo` lists it
  bool active_high = false;     // the level during the pulse; the other one is held at rest
  std::optional<Time> width{};  // instead of what the protocol asks for
};

/// For ExtraWire::trigger and ExtraWire::clear.
struct PulseWires {
  PulseWire trigger{};
  PulseWire clear{};
};

/// The calls behind a PulseOutput. Few machines that test this have such wires, and no kernel offers virtual ones: a
/// test overrides these, and sees exactly what is asked of the system. Each fails with errno.
struct WireKernel {
  virtual ~WireKernel() = default;
  /// ioctl(2) with TIOCMBIS or TIOCMBIC.
  virtual int set_modem_lines(int descriptor, unsigned long request, int lines);
  virtual gpiod_line* find_gpio(const std::string& name);
  /// As an output at 0.
  virtual int request_gpio(gpiod_line* line, bool active_low);
  virtual int set_gpio(gpiod_line* line, int value);
  virtual void release_gpio(gpiod_line* line);
};
[[nodiscard]] WireKernel& system_wires();

/// A wire that is held at rest from the beginning.
class PulseOutput {
 public:
  /// `descriptor`: of the serial port `path`. Throws Failure: `not_found`, `no_permission` and `in_use` for a GPIO
  /// line, `unsupported` when the port has no such wire, `system`.
  PulseOutput(PulseWire wire, int descriptor, std::string path, WireKernel& kernel);
  PulseOutput(const PulseOutput&) = delete;
  PulseOutput& operator=(const PulseOutput&) = delete;
  ~PulseOutput();

  void drive(bool active);
  [[nodiscard]] const PulseWire& wire() const { return wire_; }

 private:
  void open_gpio();

  PulseWire wire_;
  int descriptor_;
  std::string path_;
  WireKernel* kernel_;
  gpiod_line* line_ = nullptr;
};

}  // namespace absenc::os
