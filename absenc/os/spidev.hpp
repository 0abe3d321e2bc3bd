// SPDX-License-Identifier: Apache-2.0
// Simulates the kernel's driver spidev with a controller in front of an SpiDevice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absenc/os/spi_device.hpp"

namespace absenc::os {

/// A memory range of the program that called ioctl.
struct UserMemory {
  std::uint64_t address;
  std::size_t size;

  friend bool operator==(const UserMemory&, const UserMemory&) = default;
};

struct SpidevReply {
  int result = 0;  // return value of ioctl, read and write; negative: -errno
  /// Whether the request must be repeated with the content of the ranges `in` and with room for the ranges `out`.
  bool again = false;
  std::vector<UserMemory> in{};
  std::vector<UserMemory> out{};
  std::vector<std::uint8_t> bytes{};  // content of the ranges `out`, or the bytes that read(2) gives to the program
  Time at{};  // earliest time for the reply to the program: the end of the SPI message if there was one
};

/// Settings of the simulated controller, and the mode flags that it supports.
struct SpidevSettings {
  std::uint32_t mode = 0;  // mode with the flags of <linux/spi/spi.h>
  std::uint8_t word_bits = 8;
  std::uint32_t speed;      // clock rate in Hz
  std::uint32_t mode_bits;  // mode flags that the controller supports
};

/// A simulated spidev device (Documentation/spi/spidev.rst) with words of 8 bits on one wire.
class Spidev {
 public:
  explicit Spidev(SpiDevice& device);

  void open() { ++users_; }
  /// Closes the device for one program. When the last program closes it, the controller's speed is reset.
  void close();

  /// Handles an ioctl. `in`: content of the memory ranges SpidevReply::in of the previous reply, empty in the first
  /// call; `room`: total size of its ranges SpidevReply::out, in bytes.
  [[nodiscard]] SpidevReply control(unsigned long request, std::uint64_t address, Bytes in, std::size_t room, Time now);
  [[nodiscard]] SpidevReply read(std::size_t size, Time now);
  [[nodiscard]] SpidevReply write(Bytes bytes, Time now);

  [[nodiscard]] SpiDevice& device() { return *device_; }
  [[nodiscard]] SpidevSettings& settings() { return settings_; }

 private:
  [[nodiscard]] SpidevReply get(unsigned long request) const;
  int set(unsigned long request, Bytes value);
  int set_mode(std::uint32_t wanted);
  [[nodiscard]] SpidevReply message(std::uint64_t address, std::size_t size, Bytes in, std::size_t room, Time now);
  [[nodiscard]] SpidevReply run(std::span<SpiTransfer> transfers, Time now);
  [[nodiscard]] SpiTransfer transfer_of(std::size_t size, std::uint32_t rate) const;

  SpiDevice* device_;
  SpidevSettings settings_;
  std::uint32_t board_speed_;
  unsigned users_ = 0;
};

}  // namespace absenc::os
