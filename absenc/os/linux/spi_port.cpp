// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/spi_port.hpp"

#include <fcntl.h>
#include <linux/spi/spidev.h>
#include <sys/file.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <system_error>

#include "absenc/os/error.hpp"
#include "absenc/os/serial_ports.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

using Kind = Failure::Kind;

namespace {

constexpr std::uint8_t word_bits = 8;  // bits of an SPI word; nearly every controller supports 8

std::string reason(int error) { return " (" + std::generic_category().message(error) + ")"; }

Failure no_device(const std::string& path) {
  std::string there;
  for (const std::string& device : spi_devices()) there += (there.empty() ? "" : ", ") + device;
  const std::string what = "there is no SPI device " + path;
  if (!there.empty()) return {Kind::not_found, what + ": this machine has " + there};
  return {Kind::not_found, what +
                               ", nor any other: switch the controller on (Raspberry Pi: dtparam=spi=on in "
                               "config.txt; others: a spidev node in the device tree)"};
}

Failure spi_failure(const std::string& path, int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR:
    case ENXIO:
    case ENODEV:
      return no_device(path);
    case ENOTTY:
    case EISDIR:
    case EINVAL:
      return {Kind::unsupported,
              path + " is not an SPI device: its name is /dev/spidevB.C, of bus B and chip select C"};
    default:
      return open_failure(path, error);
  }
}

}  // namespace

int SpiKernel::open(const std::string& path) { return ::open(path.c_str(), O_RDWR | O_CLOEXEC); }

int SpiKernel::control(int descriptor, unsigned long request, void* argument) {
  return ::ioctl(descriptor, request, argument);
}

SpiKernel& system_kernel() {
  static SpiKernel kernel;
  return kernel;
}

std::vector<std::string> spi_devices(const std::filesystem::path& sys) {
  std::vector<std::string> devices;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(sys, ignored)) {
    devices.push_back("/dev/" + entry.path().filename().string());
  }
  std::sort(devices.begin(), devices.end());
  return devices;
}

SpiPort::SpiPort(const std::string& path, LinkKind kind, const LineSettings& settings, const SpiChoice& choice,
                 SpiKernel& kernel)
    : TransferPort(kind), path_(path), choice_(choice), kernel_(&kernel), descriptor_(kernel.open(path)) {
  if (kind == LinkKind::clocked_bidirectional) {
    throw Failure(Kind::unsupported,
                  "an SPI controller of Linux cannot turn the direction of its data line within a transfer: use an "
                  "FT232H (docs/clock-cable.md), or a microcontroller");
  }
  if (!descriptor_) throw spi_failure(path, errno);
  std::uint32_t mode = 0;
  if (control(SPI_IOC_RD_MODE32, &mode) < 0) throw spi_failure(path, errno);
  if (::flock(descriptor_.get(), LOCK_EX | LOCK_NB) < 0) throw spi_failure(path, errno);
  board_flags_ = mode & (SPI_CS_HIGH | SPI_NO_CS | SPI_READY);
  set_word();
  apply(settings);
}

void SpiPort::exchange(const ByteStep& step, TransferResult& received) {
  if (step.hold_low) {
    hold_low(step.at);
  } else {
    reach(step.at);
  }
  const bool clocked = carries_bits(kind());
  const std::size_t clocks = settings_.idle_clocks + step.bits;
  in_.assign(clocked ? (clocks + 7) / 8 : std::max(step.out.size(), step.expect), 0);
  out_.assign(step.out.begin(), step.out.end());
  out_.resize(in_.size(), 0);
  const Time before = os::now();
  if (!in_.empty()) send_message(!clocked);
  received.at = os::now();
  received.late = received.at - before;
  if (clocked) {
    extract(in_, settings_.idle_clocks, step.bits, received);
  } else {
    received.items = in_;
  }
}

// Sends `out_` and receives `in_` in one SPI message: the chip stays selected from the first transfer to the last.
void SpiPort::send_message(bool with_output) {
  std::array<spi_ioc_transfer, 2> transfers{};
  const auto lead = std::chrono::ceil<std::chrono::microseconds>(settings_.select_lead).count();
  // The first of two transfers has no bytes: it only waits between chip select and the first clock.
  transfers[0].delay_usecs = static_cast<std::uint16_t>(lead);
  spi_ioc_transfer& bytes = transfers[1];
  if (with_output) bytes.tx_buf = reinterpret_cast<std::uintptr_t>(out_.data());
  bytes.rx_buf = reinterpret_cast<std::uintptr_t>(in_.data());
  bytes.len = static_cast<std::uint32_t>(in_.size());
  const int result = lead > 0 ? control(SPI_IOC_MESSAGE(2), transfers.data()) : control(SPI_IOC_MESSAGE(1), &bytes);
  if (result == static_cast<int>(in_.size())) return;
  const int error = result < 0 ? errno : EIO;
  // ENOTCONN and ECONNABORTED: a program served this device with CUSE and has ended.
  if (error == ENODEV || error == ESHUTDOWN || error == ENOTCONN || error == ECONNABORTED) {
    throw Failure(Kind::lost, path_ + " went away: was its driver unloaded?");
  }
  const std::string what = path_ + " refused a message of " + std::to_string(in_.size()) + " bytes at " +
                           std::to_string(settings_.rate) + " Hz in mode " + std::to_string(settings_.spi_mode) +
                           reason(error);
  if (error == EMSGSIZE) {
    throw Failure(Kind::unsupported, what + ": load the module spidev with a larger bufsiz");
  }
  throw Failure(Kind::system, what + ": try another speed=HZ, and see what the kernel says in dmesg");
}

// Applies only changed settings: a conversation may configure the line before each reading.
void SpiPort::apply(LineSettings settings) {
  settings.rate = choice_.speed.value_or(settings.rate);
  settings.spi_mode = choice_.mode.value_or(settings.spi_mode);
  const bool first = settings_.rate == 0;
  if (first || settings.spi_mode != settings_.spi_mode) set_mode(settings.spi_mode);
  if (first || settings.rate != settings_.rate) set_speed(settings.rate);
  settings_ = settings;
}

void SpiPort::change_rate(std::uint32_t rate) {
  LineSettings settings = settings_;
  settings.rate = rate;
  apply(settings);
}

void SpiPort::set_mode(std::uint8_t mode) {
  constexpr std::uint32_t ours = SPI_CPHA | SPI_CPOL | SPI_LSB_FIRST | SPI_3WIRE | SPI_LOOP;
  std::uint32_t wanted = board_flags_ | mode;
  std::uint32_t given = 0;
  const bool set = control(SPI_IOC_WR_MODE32, &wanted) >= 0;
  const int error = set ? EINVAL : errno;
  if (set && control(SPI_IOC_RD_MODE32, &given) >= 0 && (given & ours) == mode) return;
  std::string advice = "use another controller";
  if (carries_bits(kind())) {
    advice =
        "swap the two wires of the clock pair and set spi_mode=" + std::to_string(mode ^ SPI_CPOL) + ", or " + advice;
  }
  throw Failure(Kind::unsupported, "the controller of " + path_ + " refused SPI mode " + std::to_string(mode) +
                                       reason(error) + ": " + advice);
}

// Some drivers apply a new idle level of the clock only with the next message.
void SpiPort::hold_low(Time until) {
  const std::uint8_t mode = settings_.spi_mode;
  try {
    set_mode(static_cast<std::uint8_t>(mode ^ SPI_CPOL));
  } catch (const Failure&) {
    throw Failure(Kind::unsupported, "the controller of " + path_ +
                                         " cannot hold its clock low between two messages, and registers are asked for "
                                         "by that: use one with SPI modes 1 and 3, or a microcontroller");
  }
  reach(until);
  set_mode(mode);
}

void SpiPort::set_word() {
  std::uint8_t wanted = word_bits;
  std::uint8_t given = 0;
  const bool set = control(SPI_IOC_WR_BITS_PER_WORD, &wanted) >= 0;
  const int error = set ? EINVAL : errno;
  // The kernel may report a word length of 8 bits as 0.
  if (set && control(SPI_IOC_RD_BITS_PER_WORD, &given) >= 0 && (given == word_bits || given == 0)) return;
  throw Failure(Kind::unsupported, "the controller of " + path_ + " refused words of " + std::to_string(word_bits) +
                                       " bits" + reason(error) + ": use another controller");
}

void SpiPort::set_speed(std::uint32_t speed) {
  std::uint32_t given = 0;
  if (control(SPI_IOC_WR_MAX_SPEED_HZ, &speed) < 0 || control(SPI_IOC_RD_MAX_SPEED_HZ, &given) < 0) {
    throw Failure(Kind::bad_rate, "the controller of " + path_ + " refused a clock of " + std::to_string(speed) +
                                      " Hz" + reason(errno) + ": try another one with speed=HZ");
  }
  if (given == speed) return;
  throw Failure(Kind::bad_rate, "the controller of " + path_ + " makes a clock of " + std::to_string(given) +
                                    " Hz when asked for " + std::to_string(speed) +
                                    " Hz: set speed=" + std::to_string(given));
}

}  // namespace absenc::os
