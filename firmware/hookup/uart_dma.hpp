// SPDX-License-Identifier: Apache-2.0
// A hookup of the library to a UART with DMA and an idle-line interrupt, on RS-485.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/core/bytes.hpp"
#include "absenc/host/carrier.hpp"

namespace absenc::firmware {

/// The class Hardware calls the UART of your microcontroller. It has these functions:
///
///   void drive(bool on);                 // DE of the transceiver; also disables its receiver, to avoid echo
///   void transmit(Bytes);                // by DMA; ends with the UART's transmission complete, not the DMA's
///   void receive(MutableBytes);          // by DMA; calls `arrived` when full, or after one character of idle line
///   std::size_t stop_receiving();        // returns the number of received bytes
///   void set_rate(std::uint32_t);
///
/// tick, transmission_complete, arrived and line_error are called from interrupts of one priority.
template <class Hardware>
class UartDma {
 public:
  /// Makes a hookup to `hardware`, which must outlive it. `latency`: duration of one character, after which the UART
  /// reports an idle line, plus the period of the tick.
  UartDma(Hardware& hardware, Time latency) : hardware_(&hardware), carrier_(*this, latency) {}

  /// Starts a conversation. Call it in the context of the interrupts.
  void start(Machine<std::uint8_t>& machine, Time now) { carrier_.start(machine, now); }
  [[nodiscard]] bool is_busy() const { return carrier_.is_busy(); }

  // ---- Functions that interrupts call

  void tick(Time now) { carrier_.tick(now); }
  // Starts receiving before the driver releases the line, because the first character may follow after 3 us.
  void transmission_complete(Time now) {
    arm(expected_);
    hardware_->drive(false);
    carrier_.sent(now);
  }
  // The other buffer is made ready before the bytes are handled, because more bytes may follow at once.
  void arrived(Time now) {
    const MutableBytes buffer = buffers_[current_];
    const std::size_t count = hardware_->stop_receiving();
    current_ ^= 1;
    arm(0);
    if (count != 0) carrier_.received(buffer.first(count), now);
  }
  void line_error(Time now) { carrier_.line_error(now); }

  // ---- Functions that the carrier calls

  void begin(const ByteStep& step) {
    if (step.kind == ByteStep::Kind::configure) return hardware_->set_rate(step.rate);
    expected_ = step.expect;
    static_cast<void>(hardware_->stop_receiving());
    hardware_->drive(true);
    hardware_->transmit(step.out);
  }
  void result(bool) {}

 private:
  // Starts receiving up to `count` bytes; 0 means as many as the buffer holds.
  void arm(std::size_t count) {
    const MutableBytes buffer = buffers_[current_];
    hardware_->receive(count == 0 ? buffer : buffer.first(std::min(count, buffer.size())));
  }

  Hardware* hardware_;
  host::Carrier<std::uint8_t, UartDma> carrier_;
  std::array<std::array<std::uint8_t, 64>, 2> buffers_{};
  std::size_t current_ = 0;
  std::size_t expected_ = 0;
};

}  // namespace absenc::firmware
