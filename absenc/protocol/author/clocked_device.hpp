// SPDX-License-Identifier: Apache-2.0
// Device side of a clocked line: the virtual encoder drives its bits while the host clocks.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/author/encoder.hpp"

namespace absenc::author {

/// Bits that the encoder drives on the line, one for each clock.
using DrivenBits = BitBuffer<512>;

/// A virtual encoder on a clocked link; a subclass provides the bits.
class ClockedDevice : public EncoderOn<std::uint8_t> {
 public:
  /// Handles an event that the port reports.
  void feed(const Event<std::uint8_t>& event) final;
  /// Returns the next step that the port must take.
  Step<std::uint8_t> next(Time now) final;
  /// Switches the encoder off at `now`.
  void power_off(Time now) override;
  [[nodiscard]] MutableBytes memory() override { return {}; }

 protected:
  /// Constructs an encoder that is off. `start_time`: duration of its start-up.
  explicit ClockedDevice(Time start_time = {}) : EncoderOn(start_time) {}
  ~ClockedDevice() = default;

  /// Puts the bits to drive into `bits`, which is empty, when the clock starts. `period` is that of the clock; 0:
  /// unknown. `held_low`: whether the clock line was held low before.
  virtual void selected(Time at, Time period, bool held_low, DrivenBits& bits) = 0;
  /// Is called when the host has stopped the clock after `clocks` clocks, at least one.
  virtual void clocked(Time at, std::size_t clocks) = 0;
  /// Makes the encoder drive the data line low for `time` after the last clock edge. Call it from `selected`.
  void hold_low(Time time) { low_after_ = time; }
  /// Sets how many of the driven bits hosts read, counted from the first. Call it from `selected`.
  void hosts_take(std::size_t bits) { taken_ = bits; }

 private:
  DrivenBits bits_;
  Time low_after_{};
  std::size_t taken_ = 0;  // number of the driven bits that hosts read, counted from the first; 0: all bits
  bool pending_ = false;   // true: `next` has not yet returned the step that drives `bits_`
  bool driving_ = false;
};

}  // namespace absenc::author
