// SPDX-License-Identifier: Apache-2.0
// For tests: stands in for the kernel behind an SPI port and writes down what it is asked for.
#pragma once

#include <fcntl.h>
#include <linux/spi/spidev.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <functional>
#include <map>
#include <span>
#include <string>

#include "absenc/os/spi_port.hpp"
#include "absenc/os/testing.hpp"

namespace absenc::os::testing {

/// One controller with one chip select, /dev/spidev0.0.
class FakeSpi final : public SpiKernel {
 public:
  static constexpr const char* path = "/dev/spidev0.0";

  FakeSpi() { std::ofstream{file_}; }

  // Every call gives a file description of its own, as of a device: locks work.
  int open(const std::string& name) override {
    if (name == path && open_error == 0) return ::open(file_.c_str(), O_RDWR | O_CLOEXEC);
    errno = open_error != 0 ? open_error : ENOENT;
    return -1;
  }

  int control(int, unsigned long request, void* argument) override {
    if (const auto refused = refusals.find(request); refused != refusals.end()) {
      errno = refused->second;
      return -1;
    }
    switch (request) {
      case SPI_IOC_RD_MODE32:
        return read(argument, mode);
      case SPI_IOC_WR_MODE32:
        return write("mode", argument, mode, mode_mask);
      case SPI_IOC_RD_BITS_PER_WORD:
        return read(argument, bits);
      case SPI_IOC_WR_BITS_PER_WORD:
        return write("bits", argument, bits, std::uint8_t{0xFF});
      case SPI_IOC_RD_MAX_SPEED_HZ:
        *static_cast<std::uint32_t*>(argument) = std::min(speed, highest_speed);
        return 0;
      case SPI_IOC_WR_MAX_SPEED_HZ:
        return write("speed", argument, speed, ~0u);
      case SPI_IOC_MESSAGE(1):
        return message({static_cast<spi_ioc_transfer*>(argument), 1});
      case SPI_IOC_MESSAGE(2):
        return message({static_cast<spi_ioc_transfer*>(argument), 2});
      default:
        errno = ENOTTY;
        return -1;
    }
  }

  /// What the far side puts on MISO while it sees these bytes on MOSI; empty: nothing.
  std::function<void(Bytes mosi, MutableBytes miso)> far_side;
  std::map<unsigned long, int> refusals;  // request -> errno
  int open_error = 0;
  std::uint32_t mode_mask = ~0u;  // the bits that the controller can set
  std::uint32_t highest_speed = ~0u;
  int missing = 0;  // bytes that a message falls short of

  std::uint32_t mode = SPI_MODE_0;
  std::uint8_t bits = 16;
  std::uint32_t speed = 500'000;
  std::string log;

 private:
  template <class Value>
  static int read(void* argument, Value value) {
    *static_cast<Value*>(argument) = value;
    return 0;
  }
  template <class Value>
  int write(const char* what, void* argument, Value& value, Value mask) {
    value = *static_cast<Value*>(argument) & mask;
    log += std::string(what) + ' ' + std::to_string(value) + ", ";
    return 0;
  }
  int message(std::span<const spi_ioc_transfer> transfers) {
    std::uint32_t size = 0;
    for (const spi_ioc_transfer& transfer : transfers) {
      size += transfer.len;
      log += std::to_string(transfer.len) + " bytes";
      if (transfer.tx_buf == 0) log += " in";
      if (transfer.delay_usecs != 0) log += " then " + std::to_string(transfer.delay_usecs) + " us";
      log += ", ";
      if (transfer.len == 0) continue;
      const Data zeros(transfer.len, 0);
      const Bytes mosi = transfer.tx_buf == 0
                             ? Bytes(zeros)
                             : Bytes(reinterpret_cast<const std::uint8_t*>(transfer.tx_buf), transfer.len);
      const MutableBytes miso(reinterpret_cast<std::uint8_t*>(transfer.rx_buf), transfer.len);
      std::fill(miso.begin(), miso.end(), std::uint8_t{0xFF});
      if (far_side) far_side(mosi, miso);
    }
    return static_cast<int>(size) - missing;
  }

  TemporaryDirectory directory_;
  std::filesystem::path file_ = directory_.path() / "spidev0.0";
};

}  // namespace absenc::os::testing
