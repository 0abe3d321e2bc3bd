// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/port_facts.hpp"

#include <fcntl.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "absenc/os/descriptor.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/serial_ports.hpp"

namespace absenc::os {

namespace {

void read_terminal(int descriptor, PortFacts& facts) {
  serial_rs485 direction{};
  if (::ioctl(descriptor, TIOCGRS485, &direction) == 0) {
    facts.kernel_direction = (direction.flags & SER_RS485_ENABLED) != 0;
  }
  serial_icounter_struct counts{};
  if (::ioctl(descriptor, TIOCGICOUNT, &counts) != 0) return;
  const auto number = [](int count) { return static_cast<std::uint64_t>(std::max(count, 0)); };
  facts.counts = LineCounts{number(counts.brk), number(counts.frame), number(counts.parity), number(counts.overrun)};
}

}  // namespace

PortFacts port_facts(const std::string& path, const std::filesystem::path& sys) {
  PortFacts facts;
  std::error_code error;
  const std::string terminal = std::filesystem::canonical(path, error).filename();
  if (error) return facts;
  facts.driver = driver_of(terminal, sys);
  facts.latency_timer = latency_timer(terminal, sys);
  facts.pseudo_terminal = is_pseudo_terminal(path);
  if (facts.pseudo_terminal) return facts;
  const Descriptor descriptor(::open(path.c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (descriptor) read_terminal(descriptor.get(), facts);
  return facts;
}

bool is_modem_driver(const std::string& driver) {
  constexpr std::array<std::string_view, 7> modems{"option1", "option", "qcserial", "sierra", "hso", "ipw", "qcaux"};
  return std::find(modems.begin(), modems.end(), driver) != modems.end();
}

bool is_bare_uart(const std::string& driver) {
  constexpr std::array<std::string_view, 6> uarts{"serial8250", "serial",   "of_serial",
                                                  "uart-pl011", "imx-uart", "dw-apb-uart"};
  return std::find(uarts.begin(), uarts.end(), driver) != uarts.end();
}

}  // namespace absenc::os
