// SPDX-License-Identifier: Apache-2.0
// An SPI controller of Linux (spidev): encoders that speak SPI, and as the clock master those that are clocked (SSI,
// BiSS).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "absenc/link/port.hpp"
#include "absenc/os/descriptor.hpp"
#include "absenc/os/waiting.hpp"

namespace absenc::os {

/// The system calls of SpiPort. Machines that build and test this rarely have an SPI controller or the right to make a
/// virtual one (os/cuse): a test overrides these two, and sees exactly what is asked of the kernel.
struct SpiKernel {
  virtual ~SpiKernel() = default;
  /// As open(2) with O_RDWR: negative, with errno, when refused.
  virtual int open(const std::string& path);
  /// As ioctl(2).
  virtual int control(int descriptor, unsigned long request, void* argument);
};
[[nodiscard]] SpiKernel& system_kernel();

/// What the user says of the controller; goes before what the protocol asks for, now and in every `configure`.
struct SpiChoice {
  std::optional<std::uint32_t> speed;  // Hz
  std::optional<std::uint8_t> mode;    // 0 to 3
};

/// Every function throws Failure or Interrupted (os/signals.hpp). Locked against other programs that lock it.
///
/// A transfer begins at `at`, never earlier, and `begin` blocks until it is over. `expect` says on an `spi` link
/// how many bytes come at least; on a `clocked` one nothing is sent but clocks. A controller clocks whole bytes: after
/// `idle_clocks` the first `bits` bits are handed out, and up to seven clocks more are given.
/// `timer` is reported as by StreamPort.
class SpiPort final : public Port<std::uint8_t> {
 public:
  /// `path`: /dev/spidevB.C. `kind` is spi or clocked. `kernel` must outlive the port.
  SpiPort(const std::string& path, LinkKind kind, const LineSettings& settings, const SpiChoice& choice = {},
          SpiKernel& kernel = system_kernel());
  SpiPort(const SpiPort&) = delete;
  SpiPort& operator=(const SpiPort&) = delete;

  [[nodiscard]] Time now() override;
  void begin(const Step<std::uint8_t>& step) override;
  [[nodiscard]] Event<std::uint8_t> wait(const Step<std::uint8_t>& step) override;

  /// As the controller has them.
  [[nodiscard]] const LineSettings& settings() const { return settings_; }

 private:
  void transfer(const Step<std::uint8_t>& step);
  void send_message(bool with_output);
  void keep_bits(std::size_t bits);

  void apply(LineSettings settings);
  void change_rate(std::uint32_t rate);
  void set_mode(std::uint8_t mode);
  void hold_low(Time until);
  void set_word();
  void set_speed(std::uint32_t speed);
  int control(unsigned long request, void* argument) { return kernel_->control(descriptor_.get(), request, argument); }

  std::string path_;
  LinkKind kind_;
  SpiChoice choice_;
  SpiKernel* kernel_;
  Descriptor descriptor_;
  std::uint32_t board_flags_ = 0;  // of the mode: how the chip select is wired
  LineSettings settings_{};

  std::vector<std::uint8_t> out_;
  std::vector<std::uint8_t> in_;
  Waiting<std::uint8_t> waiting_;
  Time sent_at_{};              // end of the last transfer
  Time sent_late_{};            // how long the call took that made it
  bool sent_pending_ = false;   // `sent` is to be reported,
  bool heard_pending_ = false;  // and then `received`
  bool idle_low_ = false;       // the data line, before the first bit of a clocked transfer
};

/// "/dev/spidev0.0" and so on, sorted. `sys` is a parameter for tests.
[[nodiscard]] std::vector<std::string> spi_devices(const std::filesystem::path& sys = "/sys/class/spidev");

}  // namespace absenc::os
