// SPDX-License-Identifier: Apache-2.0
// Wires on which a host sends pulses, in addition to the data wires: RTS, DTR or a GPIO line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absenc/core/time.hpp"

struct gpiod_line;

namespace absenc::os {

/// The user's choice of a wire for pulses. Levels of RTS and DTR are those of the UART's pins: the pin is low while
/// the modem line is set.
struct PulseWire {
  enum class Kind { none, rts, dtr, gpio } kind = Kind::none;
  std::string name{};           // name of the GPIO line as `gpioinfo` lists it; unused for RTS and DTR
  bool active_high = false;     // whether the wire is high during a pulse and low at rest; if false, the opposite
  std::optional<Time> width{};  // pulse width chosen by the user; empty: that of the protocol
};

/// The user's choice of the wires for the pulses ExtraWire::trigger and ExtraWire::clear.
struct PulseWires {
  PulseWire trigger{};
  PulseWire clear{};
};

/// An output of a UART beside its data.
enum class ModemLine : std::uint8_t { rts, dtr };

/// The system calls of a PulseOutput, which tests override. A call that fails sets errno. Here only modem lines work;
/// os/gpio adds the GPIO lines, so that programs without them need no libgpiod.
struct WireKernel {
  virtual ~WireKernel() = default;
  /// Sets or clears a modem line of the serial port with this descriptor. The pin of a UART is low while it is set.
  virtual int set_modem_line(int descriptor, ModemLine line, bool set);
  virtual gpiod_line* find_gpio(const std::string& name);
  /// Requests `line` as an output at logical level 0 (inactive).
  virtual int request_gpio(gpiod_line* line, bool active_low);
  virtual int set_gpio(gpiod_line* line, int value);
  virtual void release_gpio(gpiod_line* line);
};
[[nodiscard]] WireKernel& system_wires();
/// Returns whether this system has GPIO lines, with or without absenc::gpio.
[[nodiscard]] bool has_gpio_lines();
/// Replaces the result of `system_wires` by `kernel`, which must outlive all ports. Call it before threads are started.
void set_system_wires(WireKernel& kernel);

/// An opened wire for pulses. It is at rest (inactive) until `drive(true)` is called.
class PulseOutput {
 public:
  /// Opens the chosen wire. `descriptor` is that of the serial port at `path`. Throws Failure.
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
