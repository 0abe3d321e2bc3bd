// SPDX-License-Identifier: Apache-2.0
// A hookup of the library to a CAN controller with a receive FIFO and a transmit mailbox.
#pragma once

#include <optional>
#include <span>

#include "absenc/host/carrier.hpp"
#include "absenc/link/can.hpp"

namespace absenc::firmware {

/// The class Hardware calls the controller of your microcontroller. It has these functions:
///
///   void transmit(const CanFrame&);      // calls `transmitted` when the frame is acknowledged
///   std::optional<CanFrame> take();      // returns the oldest received frame; none if the FIFO is empty
///   void set_rate(std::uint32_t);
template <class Hardware>
class CanFifo {
 public:
  CanFifo(Hardware& hardware, Time latency) : hardware_(&hardware), carrier_(*this, latency) {}

  void start(Machine<CanFrame>& machine, Time now) { carrier_.start(machine, now); }
  [[nodiscard]] bool is_busy() const { return carrier_.is_busy(); }

  // ---- Functions that interrupts call: `transmitted` before `pending` in one handler

  void tick(Time now) { carrier_.tick(now); }
  void transmitted(Time now) {
    if (unsent_.empty()) return;
    unsent_ = unsent_.subspan(1);
    if (unsent_.empty()) return carrier_.sent(now);
    hardware_->transmit(unsent_[0]);
  }
  void pending(Time now) {
    while (const std::optional<CanFrame> frame = hardware_->take()) carrier_.received({&*frame, 1}, now);
  }

  // ---- Functions that the carrier calls

  void begin(const Step<CanFrame>& step) {
    if (step.kind == Step<CanFrame>::Kind::configure) return hardware_->set_rate(step.rate);
    unsent_ = step.out;
    if (!unsent_.empty()) hardware_->transmit(unsent_[0]);
  }
  void result(bool) {}

 private:
  Hardware* hardware_;
  host::Carrier<CanFrame, CanFifo> carrier_;
  std::span<const CanFrame> unsent_{};
};

}  // namespace absenc::firmware
