// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/serial.hpp"

#include <fcntl.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>

#include <cerrno>
#include <filesystem>
#include <string>

#include "absenc/os/error.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

namespace {

Descriptor open_terminal(const std::string& path, SerialUse use) {
  const int access = use == SerialUse::receive ? O_RDONLY : O_RDWR;
  Descriptor descriptor(::open(path.c_str(), access | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!descriptor) throw open_failure(path, errno);
  // Whether the path is a terminal is checked before any wait: epoll refuses regular files with a less clear error.
  if (!terminal_state(descriptor.get())) throw open_failure(path, errno);
  return descriptor;
}

// Slaves of Unix98 pseudo-terminals have the major numbers 136 to 143 (devices.txt).
bool is_pseudo(const struct stat& status) { return major(status.st_rdev) >= 136 && major(status.st_rdev) <= 143; }

bool is_pseudo_terminal(int descriptor) {
  struct stat status {};
  return ::fstat(descriptor, &status) == 0 && is_pseudo(status);
}

}  // namespace

bool is_pseudo_terminal(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && is_pseudo(status);
}

SerialPort::SerialPort(const std::string& path, const LineSettings& settings, Rs485 rs485, const PulseWires& wires,
                       WireKernel& kernel, SerialUse use)
    : DescriptorPort(open_terminal(path, use), "the port " + path),
      path_(path),
      pseudo_(is_pseudo_terminal(descriptor())) {
  const auto before = terminal_state(descriptor());
  if (!before) throw open_failure(path, errno);
  before_ = *before;
  lock();
  ::tcflush(descriptor(), TCOFLUSH);  // unsent bytes of another program must not delay the first request
  try {
    apply(settings);
    const bool with_rts = uses_rts(wires, rs485);
    if (use == SerialUse::receive) {
      const int rts = TIOCM_RTS;  // RTS is cleared: the kernel set it when the port was opened
      ::ioctl(descriptor(), TIOCMBIC, &rts);
    } else {
      set_direction(with_rts ? Rs485::off : rs485);
      if (rs485 == Rs485::rts) switch_by_rts(kernel);
      take_wires(wires, kernel);
    }
  } catch (...) {
    restore_terminal(descriptor(), before_);
    throw;
  }
  shorten_latency();
  ::tcflush(descriptor(), TCIFLUSH);
}

SerialPort::~SerialPort() {
  restore_terminal(descriptor(), before_);
  if (!pseudo_) ::ioctl(descriptor(), TIOCNXCL);
}

// flock(2) keeps out programs that use flock, also those of root. TIOCEXCL keeps out all programs except those of
// root.
void SerialPort::lock() const {
  if (::flock(descriptor(), LOCK_EX | LOCK_NB) < 0) throw open_failure(path_, errno);
  // A virtual encoder keeps the slave open, so that TIOCEXCL would outlive this port.
  if (!pseudo_) ::ioctl(descriptor(), TIOCEXCL);
}

// A change of the rate leaves parity and stop bits unchanged.
void SerialPort::change_rate(std::uint32_t rate) {
  LineSettings settings = line_;
  settings.rate = rate;
  apply(settings);
}

// A gadget port (ttyGS of u_serial.c) is the device's end of a USB cable.
bool SerialPort::is_gadget() const {
  std::error_code ignored;
  return std::filesystem::canonical(path_, ignored).filename().native().starts_with("ttyGS");
}

std::string SerialPort::rate_instead(std::uint32_t requested, std::uint32_t given) const {
  serial_struct serial{};
  const bool known = ::ioctl(descriptor(), TIOCGSERIAL, &serial) == 0 && serial.baud_base >= 0;
  const std::uint32_t clock = known ? static_cast<std::uint32_t>(serial.baud_base) : 0;
  return "its nearest rate is " + std::to_string(nearest_rate(requested, given, clock)) +
         ": use another adapter, or that rate if the encoder can have it";
}

void SerialPort::set_direction(Rs485 rs485) {
  serial_rs485 direction{};
  const bool known = ::ioctl(descriptor(), TIOCGRS485, &direction) == 0;
  if (rs485 == Rs485::off || rs485 == Rs485::rts) {
    if (!known || (direction.flags & SER_RS485_ENABLED) == 0) return;
    direction.flags &= ~static_cast<std::uint32_t>(SER_RS485_ENABLED);
    ::ioctl(descriptor(), TIOCSRS485, &direction);
    return;
  }
  if (known) {
    direction.flags |= SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND;
    direction.flags &= ~static_cast<std::uint32_t>(SER_RS485_RTS_AFTER_SEND);
    kernel_direction_ = ::ioctl(descriptor(), TIOCSRS485, &direction) == 0;
  }
  if (rs485 == Rs485::on && !kernel_direction_) {
    throw Failure(Failure::Kind::unsupported, "the driver of the port " + path_ +
                                                  " cannot switch the direction of RS-485: use an adapter that "
                                                  "does it by itself, or rs485=rts");
  }
}

void SerialPort::wait_until_sent() {
  while (::tcdrain(descriptor()) < 0) {
    if (errno != EINTR) fail(errno);
  }
}

void SerialPort::shorten_latency() {
  // The latency of a pseudo-terminal includes the time until the processes of host and encoder are scheduled: with 2
  // ms, replies in time were reported as timeouts.
  set_latency(pseudo_ ? 20ms : 10ms);
  if (pseudo_) return;
  serial_struct serial{};
  if (::ioctl(descriptor(), TIOCGSERIAL, &serial) == 0) {
    serial.flags |= ASYNC_LOW_LATENCY;
    ::ioctl(descriptor(), TIOCSSERIAL, &serial);
  }
  std::error_code ignored;
  const std::string terminal = std::filesystem::canonical(path_, ignored).filename();
  if (const auto milliseconds = latency_timer(terminal)) {
    set_latency(latency() + std::chrono::milliseconds(*milliseconds));
    if (*milliseconds > 1) {
      notes_.push_back("the latency timer of " + terminal + " is " + std::to_string(*milliseconds) +
                       " ms, which limits the readings a second: " + way_to_shorter_latency(terminal));
    }
  }
}

}  // namespace absenc::os
