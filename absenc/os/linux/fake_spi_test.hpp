// SPDX-License-Identifier: Apache-2.0
// Test replacement for the kernel behind an SPI port, with a log of settings and messages.
#pragma once

#include <fcntl.h>
#include <linux/spi/spidev.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <string>

#include "absenc/os/linux/testing.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/spi_port.hpp"
#include "absenc/os/spidev.hpp"

namespace absenc::os::testing {

/// A simulated SPI controller with one chip select, /dev/spidev0.0. Its SPI messages are answered by a Spidev.
class FakeSpi final : public SpiKernel {
 public:
  static constexpr const char* path = "/dev/spidev0.0";

  FakeSpi() {
    std::ofstream{file_};
    connect(LinkKind::spi, {.rate = 500'000, .spi_mode = 1}, nobody_);
  }

  /// Connects `device` to the controller; before the first call no device is connected.
  void connect(LinkKind kind, const LineSettings& settings, Machine<std::uint8_t>& device) {
    const SpidevSettings before = spidev_ ? spidev_->settings() : SpidevSettings{0, 16, 500'000, ~0u};
    device_ = std::make_unique<SpiDevice>(kind, settings, device);
    spidev_ = std::make_unique<Spidev>(*device_);
    spidev_->settings() = before;
  }

  // Each successful call opens a new file description, as open(2) of a device does, so that locks work.
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
    int result = carry(request, argument);
    settings().mode &= mode_mask;
    if (request == SPI_IOC_RD_MAX_SPEED_HZ) {
      auto* const speed = static_cast<std::uint32_t*>(argument);
      *speed = std::min(*speed, highest_speed);
    }
    write_down(request, static_cast<const spi_ioc_transfer*>(argument));
    if (_IOC_NR(request) == 0) result -= missing;
    return result;
  }

  [[nodiscard]] SpidevSettings& settings() { return spidev_->settings(); }
  [[nodiscard]] SpiDevice& device() { return *device_; }

  std::map<unsigned long, int> refusals;  // errno with which requests of ioctl fail, by request number
  int open_error = 0;
  std::uint32_t mode_mask = ~0u;  // SPI mode bits that have an effect; others are accepted, but ignored
  std::uint32_t highest_speed = ~0u;
  int missing = 0;       // number of bytes by which the result of a message is too short
  bool shorted = false;  // whether the data line is shorted to low
  std::string log;

 private:
  struct Nobody final : Machine<std::uint8_t> {
    void feed(const ByteEvent&) override {}
    ByteStep next(Time) override { return {.at = never}; }
  };

  static void* at(const UserMemory& memory) { return reinterpret_cast<void*>(memory.address); }

  // Serves a request of ioctl as CUSE does: copies the memory that the SpidevReply asks for.
  int carry(unsigned long request, void* argument) {
    Data in;
    std::vector<UserMemory> out;
    std::size_t room = 0;
    SpidevReply reply;
    for (;;) {
      reply = spidev_->control(request, reinterpret_cast<std::uintptr_t>(argument), in, room, os::now());
      if (!reply.again) break;
      in.clear();
      for (const UserMemory& one : reply.in) {
        in.resize(in.size() + one.size);
        std::memcpy(in.data() + in.size() - one.size, at(one), one.size);
      }
      room = 0;
      for (const UserMemory& one : reply.out) room += one.size;
      out = reply.out;
    }
    reach(reply.at);
    if (shorted && _IOC_NR(request) == 0) std::fill(reply.bytes.begin(), reply.bytes.end(), std::uint8_t{0});
    std::size_t done = 0;
    for (const UserMemory& one : out) {
      std::memcpy(at(one), reply.bytes.data() + done, one.size);
      done += one.size;
    }
    if (reply.result >= 0) return reply.result;
    errno = -reply.result;
    return -1;
  }

  void write_down(unsigned long request, const spi_ioc_transfer* transfers) {
    switch (request) {
      case SPI_IOC_WR_MODE32:
        log += "mode " + std::to_string(settings().mode) + ", ";
        break;
      case SPI_IOC_WR_BITS_PER_WORD:
        log += "bits " + std::to_string(settings().word_bits) + ", ";
        break;
      case SPI_IOC_WR_MAX_SPEED_HZ:
        log += "speed " + std::to_string(settings().speed) + ", ";
        break;
      default:
        if (_IOC_NR(request) != 0) return;
        for (std::size_t i = 0; i < _IOC_SIZE(request) / sizeof *transfers; ++i) {
          log += std::to_string(transfers[i].len) + " bytes";
          if (transfers[i].tx_buf == 0) log += " in";
          if (transfers[i].delay_usecs != 0) log += " then " + std::to_string(transfers[i].delay_usecs) + " us";
          log += ", ";
        }
    }
  }

  TemporaryDirectory directory_;
  std::filesystem::path file_ = directory_.path() / "spidev0.0";
  Nobody nobody_;
  std::unique_ptr<SpiDevice> device_;
  std::unique_ptr<Spidev> spidev_;
};

}  // namespace absenc::os::testing
