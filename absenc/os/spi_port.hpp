// SPDX-License-Identifier: Apache-2.0
// An SPI controller of Linux (spidev), for encoders with SPI and for clocked encoders (SSI, BiSS).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "absenc/os/descriptor.hpp"
#include "absenc/os/spi_choice.hpp"
#include "absenc/os/transfer_port.hpp"

namespace absenc::os {

/// The system calls of SpiPort, which tests override.
struct SpiKernel {
  virtual ~SpiKernel() = default;
  /// Opens `path` like open(2) with O_RDWR: returns a negative number, with errno set, on failure.
  virtual int open(const std::string& path);
  /// Sends a request to the driver like ioctl(2), and returns its result.
  virtual int control(int descriptor, unsigned long request, void* argument);
};
[[nodiscard]] SpiKernel& system_kernel();

/// A port on an SPI controller, locked against other programs that use flock(2). On clocked encoders (SSI, BiSS) a
/// transfer has up to seven additional clocks, because a controller clocks whole bytes. `begin` and `wait` throw
/// Failure, Interrupted or Ended.
class SpiPort final : public TransferPort {
 public:
  /// Opens the controller at `path`, /dev/spidevB.C; `kind`: spi or clocked, else throws invalid_argument. `kernel`
  /// must outlive the port. Throws Failure.
  SpiPort(const std::string& path, LinkKind kind, const LineSettings& settings, const SpiChoice& choice = {},
          SpiKernel& kernel = system_kernel());

  /// Returns the settings that the controller uses.
  [[nodiscard]] const LineSettings& settings() const { return settings_; }

 private:
  void exchange(const Step<std::uint8_t>& step, TransferResult& received) override;
  [[nodiscard]] std::uint32_t set_rate() const override { return settings_.rate; }
  void change_rate(std::uint32_t rate) override;
  void send_message(bool with_output);

  void apply(LineSettings settings);
  void set_mode(std::uint8_t mode);
  void hold_low(Time until);
  void set_word();
  void set_speed(std::uint32_t speed);
  int control(unsigned long request, void* argument) { return kernel_->control(descriptor_.get(), request, argument); }

  std::string path_;
  SpiChoice choice_;
  SpiKernel* kernel_;
  Descriptor descriptor_;
  // mode flags that belong to the board's wiring (for example the polarity of chip select); they are never changed
  std::uint32_t board_flags_ = 0;
  LineSettings settings_{};

  std::vector<std::uint8_t> out_;
  std::vector<std::uint8_t> in_;
};

/// Returns the paths of all spidev devices, "/dev/spidev0.0" and so on, sorted.
[[nodiscard]] std::vector<std::string> spi_devices(const std::filesystem::path& sys = "/sys/class/spidev");

}  // namespace absenc::os
