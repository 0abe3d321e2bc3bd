// SPDX-License-Identifier: Apache-2.0
// The far side of an SPI controller: makes the edges of a message into the events of a device machine, and what it
// drives into samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absenc/link/step.hpp"

namespace absenc::os {

/// A part of a message, as spidev has them.
struct SpiTransfer {
  std::size_t size = 0;    // bytes; without both buffers nothing is clocked
  Bytes out{};             // of `size`, or empty: zeros
  MutableBytes in{};       // of `size`, or empty: nobody looks
  std::uint32_t rate = 0;  // Hz
  std::uint8_t mode = 0;   // 2 * CPOL + CPHA
  bool lsb_first = false;
  Time delay{};           // behind the last bit
  bool deselect = false;  // behind `delay`; of the last transfer: the chip stays selected
};

/// One device machine. Whether the controller's mode suits it or not, an edge is what it is: who samples at an edge at
/// which the other side shifts gets the old bit, and a bit that nobody drives is 1. The device is told a message at
/// once, with the times at which its parts will be. It is no Port, because a message is asked and answered in one call;
/// who serves it answers when that time has come.
class SpiDevice {
 public:
  /// `kind`: spi or clocked, otherwise std::invalid_argument. `device` must outlive it.
  SpiDevice(LinkKind kind, const LineSettings& settings, Machine<std::uint8_t>& device);

  /// Asks the device for its first step, as every carrier does before the first event: it may want a timer.
  void begin(Time now) { ask(now); }
  /// Returns when it ends. On a clocked link a pause of the clock between two transfers ends a word.
  Time message(std::span<const SpiTransfer> transfers, Time start);

  /// The controller was set to another mode between two messages: its clock rests at the level of that until the next.
  void rest(std::uint8_t mode);

  /// When the device wants to be woken.
  [[nodiscard]] Time timer() const { return timer_; }
  /// Nothing happens before `timer()`.
  void wake(Time now);

  [[nodiscard]] const LineSettings& settings() const { return settings_; }
  /// Messages in which something was clocked.
  [[nodiscard]] std::uint64_t messages() const { return messages_; }
  /// Those whose clock or sampling did not suit the device.
  [[nodiscard]] std::uint64_t wrong_modes() const { return wrong_modes_; }

 private:
  void select(Time at, Time period);
  void deselect(Time at);
  Time clock(const SpiTransfer& transfer, Time at);
  void feed(const Event<std::uint8_t>& event);
  void ask(Time now);
  [[nodiscard]] bool suits(std::uint8_t mode) const;
  [[nodiscard]] bool driven(std::size_t clock, std::uint8_t mode) const;
  [[nodiscard]] bool shifts_at_leading_edge(std::uint8_t mode) const;

  LinkKind kind_;
  LineSettings settings_;
  Machine<std::uint8_t>* device_;
  Time timer_ = never;
  std::uint64_t messages_ = 0;
  std::uint64_t wrong_modes_ = 0;
  bool held_low_ = false;  // since the last message

  // Since the chip was selected, or the first clock:
  bool selected_ = false;
  std::vector<std::uint8_t> driven_;
  std::uint8_t behind_driven_ = 0xFF;
  std::vector<std::uint8_t> heard_;
  std::size_t clocks_ = 0;
  bool last_out_ = false;
  Time period_{};  // the shortest
  Time selected_at_{};
  Time lead_{};  // to the first clock
};

}  // namespace absenc::os
