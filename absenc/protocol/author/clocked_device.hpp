// SPDX-License-Identifier: Apache-2.0
// Device side of a clocked line: drives its bits while the host clocks. It knows no protocol, and is compiled once.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/author/encoder.hpp"

namespace absenc::author {

/// Bits that the encoder drives on the line, one for each clock. After them the line idles.
using DrivenBits = BitBuffer<512>;

/// A virtual encoder on a clocked link.
class ClockedDevice : public EncoderOn<std::uint8_t> {
 public:
  /// Takes an event of the port.
  void feed(const Event<std::uint8_t>& event) final;
  /// Returns the next step of the port.
  Step<std::uint8_t> next(Time now) final;
  /// Switches the encoder off.
  void power_off(Time now) override;
  [[nodiscard]] MutableBytes memory() override { return {}; }

 protected:
  /// Is ready `start_time` after it was switched on.
  explicit ClockedDevice(Time start_time = {}) : EncoderOn(start_time) {}
  ~ClockedDevice() = default;

  /// The clock starts with this period; 0: unknown. `held_low`: the clock line was held low before, not idle, which few
  /// protocols use. The encoder puts the bits that it drives into `bits`, which is empty.
  virtual void selected(Time at, Time period, bool held_low, DrivenBits& bits) = 0;
  /// The host has stopped after `clocks` clocks, at least one.
  virtual void clocked(Time at, std::size_t clocks) = 0;
  /// Drives the line low for `time` after the last edge of the clock. Call it from `selected`.
  void hold_low(Time time) { low_after_ = time; }
  /// Sets how many of the driven bits hosts read, which are those that a fault of the line damages. Call it from
  /// `selected`.
  void hosts_take(std::size_t bits) { taken_ = bits; }

 private:
  DrivenBits bits_;
  Time low_after_{};
  std::size_t taken_ = 0;  // 0: all bits
  bool pending_ = false;   // bits are to be driven
  bool driving_ = false;
};

}  // namespace absenc::author
