// SPDX-License-Identifier: Apache-2.0
// The parts of a serial port that are the same on all systems.
#include "absenc/os/serial.hpp"

#include <algorithm>
#include <cerrno>
#include <string_view>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

namespace {

std::string_view name_of(Parity parity) {
  switch (parity) {
    case Parity::odd:
      return "odd";
    case Parity::even:
      return "even";
    case Parity::none:
      break;
  }
  return "no";
}

}  // namespace

bool SerialPort::uses_rts(const PulseWires& wires, Rs485 rs485) {
  const bool uses = wires.trigger.kind == PulseWire::Kind::rts || wires.clear.kind == PulseWire::Kind::rts;
  if (uses && (rs485 == Rs485::on || rs485 == Rs485::rts)) {
    throw Failure(Failure::Kind::unsupported,
                  std::string("RTS cannot switch the direction of RS-485 and carry pulses: use DTR ") +
                      (has_gpio_lines() ? "or a GPIO line " : "") + "for them");
  }
  return uses;
}

void SerialPort::apply(const LineSettings& settings) {
  if (settings.rate == 0) throw Failure(Failure::Kind::bad_rate, "a serial port needs a baud rate above 0");
  if (settings.data_bits > 8 && !pseudo_) {
    throw Failure(Failure::Kind::unsupported, "the port " + path_ + " is a UART, and no UART has " +
                                                  std::to_string(settings.data_bits) +
                                                  "-bit characters: decode a capture, or emulate with sim:");
  }
  const std::optional<LineSettings> given = set_terminal(descriptor(), settings);
  if (!given) fail(errno);  // the adapter may have been unplugged since the port was opened
  line_ = settings;
  if (is_gadget()) return;
  if (!rates_agree(settings.rate, given->rate)) {
    throw Failure(Failure::Kind::bad_rate, "the port " + path_ + " cannot do " + std::to_string(settings.rate) +
                                               " baud, " + rate_instead(settings.rate, given->rate));
  }
  if (pseudo_) return;  // a pseudo-terminal has no line: parity is ignored and characters take no time
  if (given->parity != settings.parity || given->stop_bits != settings.stop_bits ||
      given->data_bits != settings.data_bits) {
    throw Failure(Failure::Kind::unsupported, "the port " + path_ + " cannot do " + std::to_string(settings.data_bits) +
                                                  " data bits, " + std::string(name_of(settings.parity)) +
                                                  " parity and " + std::to_string(settings.stop_bits) +
                                                  " stop bits: use another adapter");
  }
  set_character_time(settings.character());
}

void SerialPort::take_wires(const PulseWires& wires, WireKernel& kernel) {
  if (wires.trigger.kind != PulseWire::Kind::none) trigger_.emplace(wires.trigger, descriptor(), path_, kernel);
  if (wires.clear.kind != PulseWire::Kind::none) clear_.emplace(wires.clear, descriptor(), path_, kernel);
}

void SerialPort::switch_by_rts(WireKernel& kernel) {
  if (kernel.set_modem_line(descriptor(), ModemLine::rts, false) < 0) {
    throw Failure(Failure::Kind::unsupported,
                  "the port " + path_ +
                      " has no RTS line to switch the direction of RS-485: use an adapter that does "
                      "it by itself, without rs485=rts");
  }
  rts_ = &kernel;
  set_leaving(Leaving::in_write);
}

void SerialPort::write_all(Bytes bytes) {
  if (rts_ == nullptr) return DescriptorPort::write_all(bytes);
  const Time begun = os::now();
  if (rts_->set_modem_line(descriptor(), ModemLine::rts, true) < 0) fail(errno);
  try {
    DescriptorPort::write_all(bytes);
    wait_until_sent();
    // A driver that is done before the characters can have left has passed them to the adapter, which sends them now.
    const Time duration = character_time() * static_cast<std::int64_t>(bytes.size());
    if (const Time done = os::now(); done < begun + duration) os::reach(done + duration);
  } catch (...) {
    rts_->set_modem_line(descriptor(), ModemLine::rts, false);
    throw;
  }
  if (rts_->set_modem_line(descriptor(), ModemLine::rts, false) < 0) fail(errno);
}

void SerialPort::drive(ExtraWire wire, bool active) {
  std::optional<PulseOutput>& output = wire == ExtraWire::trigger ? trigger_ : clear_;
  if (output) return output->drive(active);
  const std::string name = wire == ExtraWire::trigger ? "trigger" : "clear";
  throw Failure(Failure::Kind::unsupported,
                "nothing says which wire carries the pulse: set " +
                    (has_gpio_lines() ? name + "=rts, " + name + "=dtr or " + name + "=gpio:NAME"
                                      : name + "=rts or " + name + "=dtr"));
}

Time SerialPort::pulse_width(ExtraWire wire, Time requested) const {
  const std::optional<PulseOutput>& output = pulse_output(wire);
  return output ? output->wire().width.value_or(requested) : requested;
}

}  // namespace absenc::os
