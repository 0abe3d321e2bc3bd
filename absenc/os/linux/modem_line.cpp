// SPDX-License-Identifier: Apache-2.0
#include <sys/ioctl.h>
#include <termios.h>

#include "absenc/os/pulse_wire.hpp"

namespace absenc::os {

int WireKernel::set_modem_line(int descriptor, ModemLine line, bool set) {
  const int lines = line == ModemLine::rts ? TIOCM_RTS : TIOCM_DTR;
  return ::ioctl(descriptor, set ? TIOCMBIS : TIOCMBIC, &lines);
}

bool has_gpio_lines() { return true; }

}  // namespace absenc::os
