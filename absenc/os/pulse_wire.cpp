// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/pulse_wire.hpp"

#include <cerrno>
#include <utility>

#include "absenc/os/error.hpp"

namespace absenc::os {

gpiod_line* WireKernel::find_gpio(const std::string&) {
  errno = ENOSYS;
  return nullptr;
}

int WireKernel::request_gpio(gpiod_line*, bool) { return -1; }

int WireKernel::set_gpio(gpiod_line*, int) { return -1; }

void WireKernel::release_gpio(gpiod_line*) {}

namespace {

WireKernel modem_lines_only;
WireKernel* all_wires = &modem_lines_only;

}  // namespace

WireKernel& system_wires() { return *all_wires; }

void set_system_wires(WireKernel& kernel) { all_wires = &kernel; }

PulseOutput::PulseOutput(PulseWire wire, int descriptor, std::string path, WireKernel& kernel)
    : wire_(std::move(wire)), descriptor_(descriptor), path_(std::move(path)), kernel_(&kernel) {
  if (wire_.kind == PulseWire::Kind::gpio) {
    open_gpio();
  } else {
    drive(false);  // the system sets RTS and DTR when a port is opened, so the wire must be put to rest
  }
}

PulseOutput::~PulseOutput() {
  if (line_ != nullptr) kernel_->release_gpio(line_);
}

void PulseOutput::open_gpio() {
  const std::string what = "the GPIO line " + wire_.name;
  if (!has_gpio_lines()) {
    throw Failure(Failure::Kind::unsupported,
                  what + " is a place of Linux, which this system does not have: use RTS or DTR");
  }
  const auto refused = [&](int error) {
    if (error == EACCES || error == EPERM) {
      return Failure(Failure::Kind::no_permission,
                     what + " may not be used by you: become a member of the group of /dev/gpiochip*, often gpio");
    }
    if (error == EBUSY) {
      return Failure(Failure::Kind::in_use, what + " is in use: `gpioinfo` shows by whom");
    }
    return system_failure("using " + what, error);
  };
  line_ = kernel_->find_gpio(wire_.name);
  if (line_ == nullptr) {
    if (errno == EACCES || errno == EPERM) throw refused(errno);
    if (errno == ENOSYS) {
      throw Failure(Failure::Kind::unsupported,
                    what + " cannot be used: this program was built without absenc::gpio; build it with that library");
    }
    throw Failure(Failure::Kind::not_found,
                  "no GPIO line of this machine is named " + wire_.name + ": `gpioinfo` lists the names");
  }
  if (kernel_->request_gpio(line_, !wire_.active_high) == 0) return;
  const int error = errno;
  kernel_->release_gpio(line_);
  throw refused(error);
}

void PulseOutput::drive(bool active) {
  if (line_ != nullptr) {
    if (kernel_->set_gpio(line_, active ? 1 : 0) < 0)
      throw system_failure("setting the GPIO line " + wire_.name, errno);
    return;
  }
  const bool is_rts = wire_.kind == PulseWire::Kind::rts;
  const bool low = active != wire_.active_high;
  if (kernel_->set_modem_line(descriptor_, is_rts ? ModemLine::rts : ModemLine::dtr, low) < 0) {
    throw Failure(Failure::Kind::unsupported, "the port " + path_ + " has no " + (is_rts ? "RTS" : "DTR") +
                                                  " line for the pulse: use an adapter that brings it out, or a GPIO "
                                                  "line");
  }
}

}  // namespace absenc::os
