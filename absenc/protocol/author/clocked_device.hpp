// SPDX-License-Identifier: Apache-2.0
// Device side of a clocked line: drives its bits while the host clocks. It knows no protocol, and is compiled once.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/author/encoder.hpp"

namespace absenc::author {

/// What is driven on the line, a bit for each clock. The line idles behind them.
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

  /// The clock begins, with this period; 0: it is not known. Whether its line was held low before, and not idle, means
  /// something to few. `bits`, empty now, is what the encoder drives.
  virtual void selected(Time at, Time period, bool held_low, DrivenBits& bits) = 0;
  /// The host has stopped after so many clocks, one at least.
  virtual void clocked(Time at, std::size_t clocks) = 0;
  /// For `selected`: from the last edge of the clock the line is driven low for so long.
  void hold_low(Time time) { low_after_ = time; }
  /// For `selected`: of the bits that are driven hosts take so many, and a fault of the line strikes those.
  void hosts_take(std::size_t bits) { taken_ = bits; }

 private:
  DrivenBits bits_;
  Time low_after_{};
  std::size_t taken_ = 0;  // 0: all
  bool pending_ = false;   // to be driven
  bool driving_ = false;
};

}  // namespace absenc::author
