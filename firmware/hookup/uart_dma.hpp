// SPDX-License-Identifier: Apache-2.0
// A UART with DMA and an interrupt when its line is idle, behind an RS-485 transceiver.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/core/bytes.hpp"
#include "absenc/host/carrier.hpp"

namespace absenc::firmware {

/// Hardware is what the part has:
///
///   void drive(bool on);                 // DE of the transceiver; its receiver off meanwhile, or nothing comes back
///   void transmit(Bytes);                // by DMA; the UART's transmission complete, not the DMA's, ends it
///   void receive(MutableBytes);          // by DMA: `arrived` when it is full, or the line was idle for a character
///   std::size_t stop_receiving();        // how many came
///   void set_rate(std::uint32_t);
///
/// The members below `Interrupts` are called from interrupts of one priority.
template <class Hardware>
class UartDma {
 public:
  /// `latency`: the character for which the line is idle, and what the timer's tick adds.
  UartDma(Hardware& hardware, Time latency) : hardware_(&hardware), carrier_(*this, latency) {}

  /// Begins a conversation. From the interrupts' context, as from a timer of their priority.
  void start(Machine<std::uint8_t>& machine, Time now) { carrier_.start(machine, now); }
  [[nodiscard]] bool is_busy() const { return carrier_.is_busy(); }

  // ---- Interrupts

  void tick(Time now) { carrier_.tick(now); }
  // The receiver is ready before the line is free: the first character may come 3 us later.
  void transmission_complete(Time now) {
    arm(expected_);
    hardware_->drive(false);
    carrier_.sent(now);
  }
  // More may follow at once: the other buffer is ready for it before this one is looked at.
  void arrived(Time now) {
    const MutableBytes buffer = buffers_[current_];
    const std::size_t count = hardware_->stop_receiving();
    current_ ^= 1;
    arm(0);
    if (count != 0) carrier_.received(buffer.first(count), now);
  }
  void line_error(Time now) { carrier_.line_error(now); }

  // ---- The line of the carrier

  void begin(const ByteStep& step) {
    if (step.kind == ByteStep::Kind::configure) return hardware_->set_rate(step.rate);
    expected_ = step.expect;
    static_cast<void>(hardware_->stop_receiving());
    hardware_->drive(true);
    hardware_->transmit(step.out);
  }
  void result(bool) {}

 private:
  // A whole reply fills the buffer, and is told with its last character; without `count` the idle line tells.
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
