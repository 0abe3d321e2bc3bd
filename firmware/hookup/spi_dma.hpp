// SPDX-License-Identifier: Apache-2.0
// A hookup of the library to an SPI controller with DMA that reads BiSS or SSI.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/core/bytes.hpp"
#include "absenc/host/carrier.hpp"

namespace absenc::firmware {

/// The class Hardware calls the controller of your microcontroller. It has these functions:
///
///   void clock(MutableBytes);            // receives by DMA, first bit first; calls `done` at the end
///   void set_rate(std::uint32_t);
///
/// Set up the controller with the unit's `line_settings`: rate, `spi_mode`, no chip select.
template <class Hardware>
class SpiDma {
 public:
  SpiDma(Hardware& hardware, const LineSettings& settings)
      : hardware_(&hardware), idle_clocks_(settings.idle_clocks), carrier_(*this) {}

  void start(Machine<std::uint8_t>& machine, Time now) { carrier_.start(machine, now); }
  [[nodiscard]] bool is_busy() const { return carrier_.is_busy(); }

  // ---- Functions that interrupts call

  void tick(Time now) { carrier_.tick(now); }
  void done(Time now) {
    align();
    carrier_.sent(now);
    carrier_.received(Bytes(buffer_).first((bits_ + 7) / 8), now);
  }

  // ---- Functions that the carrier calls

  void begin(const ByteStep& step) {
    if (step.kind == ByteStep::Kind::configure) return hardware_->set_rate(step.rate);
    bits_ = std::min(step.bits, 8 * buffer_.size() - idle_clocks_);
    hardware_->clock(MutableBytes(buffer_).first((idle_clocks_ + bits_ + 7) / 8));
  }
  void result(bool) {}

 private:
  // Shifts the received bits so that the frame begins with the first bit of the buffer.
  void align() {
    const std::size_t clocked = (idle_clocks_ + bits_ + 7) / 8;
    const std::size_t size = (bits_ + 7) / 8;
    for (std::size_t i = 0; i < size && idle_clocks_ != 0; ++i) {
      const unsigned next = i + 1 < clocked ? buffer_[i + 1] : 0u;
      buffer_[i] = static_cast<std::uint8_t>((unsigned{buffer_[i]} << 8 | next) >> (8 - idle_clocks_));
    }
    if (bits_ % 8 != 0) buffer_[size - 1] &= static_cast<std::uint8_t>(0xFF00u >> (bits_ % 8));
  }

  Hardware* hardware_;
  unsigned idle_clocks_;  // number of clocks before the first bit of the frame, fewer than 8
  host::Carrier<std::uint8_t, SpiDma> carrier_;
  std::array<std::uint8_t, 64> buffer_{};
  std::size_t bits_ = 0;
};

}  // namespace absenc::firmware
