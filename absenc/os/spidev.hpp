// SPDX-License-Identifier: Apache-2.0
// The kernel's driver spidev and a controller in front of an SpiDevice: answers what programs ask of /dev/spidevB.C.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absenc/os/spi_device.hpp"

namespace absenc::os {

/// Of the program that asks.
struct UserMemory {
  std::uint64_t address;
  std::size_t size;

  friend bool operator==(const UserMemory&, const UserMemory&) = default;
};

struct SpidevReply {
  int result = 0;  // as ioctl, read and write return it; negative: -errno
  /// The same again, with what stands at `in`, and room for what goes to `out`: one after the other.
  bool again = false;
  std::vector<UserMemory> in{};
  std::vector<UserMemory> out{};
  std::vector<std::uint8_t> bytes{};  // for that room
  Time at{};                          // not before: the message is over then
};

/// What it is set to, and how it can be set.
struct SpidevSettings {
  std::uint32_t mode = 0;  // with the flags of <linux/spi/spi.h>
  std::uint8_t word_bits = 8;
  std::uint32_t speed;      // Hz
  std::uint32_t mode_bits;  // those that the controller has
};

/// As Documentation/spi/spidev.rst has it, with the module's own limits. The controller sends words of 8 bits on one
/// wire, at every speed, and selects the chip as it is wired. At first it is in mode 0, as without a word in the device
/// tree. It never touches the memory of the program that asks but says which it wants, as the kernel wants it from
/// CUSE; tests fetch it by pointer.
class Spidev {
 public:
  explicit Spidev(SpiDevice& device);

  void open() { ++users_; }
  /// The last one gives the speed back.
  void close();

  /// `in`: what `in` of the last reply asked for; empty at first. `room`: the same of `out`. Errors: ENOTTY (no request
  /// of spidev), EINVAL, EMSGSIZE (more than 4096 bytes either way, or more than 255 buffers).
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
