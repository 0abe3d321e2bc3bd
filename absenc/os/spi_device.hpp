// SPDX-License-Identifier: Apache-2.0
// The device side of an SPI controller.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absenc/link/step.hpp"

namespace absenc::os {

/// One transfer of an SPI message, as in spidev.
struct SpiTransfer {
  std::size_t size = 0;    // number of bytes of the transfer; if `out` and `in` are both empty, nothing is clocked
  Bytes out{};             // bytes that the host sends, `size` of them; empty: zeros are sent
  MutableBytes in{};       // buffer for the bytes of the device, `size` of them; empty: they are discarded
  std::uint32_t rate = 0;  // clock rate in Hz
  std::uint8_t mode = 0;   // SPI mode: 2 * CPOL + CPHA
  bool lsb_first = false;
  Time delay{};  // pause after the last bit of the transfer
  // whether the chip is deselected after `delay`, before the next transfer; in the last transfer of a message, whether
  // the chip stays selected
  bool deselect = false;
};

/// One virtual SPI or clocked encoder behind a controller, simulated edge by edge in every SPI mode.
class SpiDevice {
 public:
  /// `kind` must be spi or clocked: throws std::invalid_argument for other kinds. `device` must outlive this object.
  SpiDevice(LinkKind kind, const LineSettings& settings, Machine<std::uint8_t>& device);

  /// Starts the device: executes its first step, which may request a timer.
  void begin(Time now) { run_device(now); }
  /// Sends the transfers of an SPI message, beginning at `start`, and returns the time of its end.
  Time message(std::span<const SpiTransfer> transfers, Time start);

  /// Records that the clock line rests between two messages at the idle level of the SPI mode `mode`.
  void rest(std::uint8_t mode);

  /// Returns the time at which `wake` must be called; `never` if the device has requested no timer.
  [[nodiscard]] Time timer() const { return timer_; }
  /// Reports to the device that its timer has expired; does nothing before the time `timer()`.
  void wake(Time now);

  [[nodiscard]] const LineSettings& settings() const { return settings_; }
  /// Returns the number of SPI messages in which bits were clocked.
  [[nodiscard]] std::uint64_t messages() const { return messages_; }
  /// Returns the number of messages whose SPI mode did not suit the device.
  [[nodiscard]] std::uint64_t wrong_modes() const { return wrong_modes_; }

 private:
  void select(Time at, Time period);
  void deselect(Time at);
  Time clock(const SpiTransfer& transfer, Time at);
  void feed(const Event<std::uint8_t>& event);
  void run_device(Time now);
  [[nodiscard]] bool suits(std::uint8_t mode) const;
  [[nodiscard]] bool driven(std::size_t clock, std::uint8_t mode) const;
  [[nodiscard]] bool shifts_at_leading_edge(std::uint8_t mode) const;

  LinkKind kind_;
  LineSettings settings_;
  Machine<std::uint8_t>* device_;
  Time timer_ = never;
  std::uint64_t messages_ = 0;
  std::uint64_t wrong_modes_ = 0;
  bool held_low_ = false;

  // State since the chip was selected (SPI) or since the first clock of a word (clocked encoder).
  bool selected_ = false;
  std::vector<std::uint8_t> driven_;
  std::uint8_t after_driven_ = 0xFF;
  std::vector<std::uint8_t> received_;
  std::size_t clocks_ = 0;
  bool last_out_ = false;
  Time period_{};  // shortest clock period since the chip was selected
  Time selected_at_{};
  Time lead_{};  // time from chip select to the first clock
};

}  // namespace absenc::os
