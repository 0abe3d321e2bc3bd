// SPDX-License-Identifier: Apache-2.0
// A CAN controller with a FIFO for what it receives and a mailbox for what it sends.
#pragma once

#include <optional>
#include <span>

#include "absenc/host/carrier.hpp"
#include "absenc/link/can.hpp"

namespace absenc::firmware {

/// Hardware is what the part has:
///
///   void transmit(const CanFrame&);      // `transmitted` when it was acknowledged
///   std::optional<CanFrame> take();      // the oldest that came; none: the FIFO is empty
///   void set_rate(std::uint32_t);
template <class Hardware>
class CanFifo {
 public:
  CanFifo(Hardware& hardware, Time latency) : hardware_(&hardware), carrier_(*this, latency) {}

  void start(Machine<CanFrame>& machine, Time now) { carrier_.start(machine, now); }
  [[nodiscard]] bool is_busy() const { return carrier_.is_busy(); }

  // ---- Interrupts; of one handler for both call `transmitted` first

  void tick(Time now) { carrier_.tick(now); }
  void transmitted(Time now) {
    if (going_.empty()) return;
    going_ = going_.subspan(1);
    if (going_.empty()) return carrier_.sent(now);
    hardware_->transmit(going_[0]);
  }
  void pending(Time now) {
    while (const std::optional<CanFrame> frame = hardware_->take()) carrier_.received({&*frame, 1}, now);
  }

  // ---- The line of the carrier

  void begin(const Step<CanFrame>& step) {
    if (step.kind == Step<CanFrame>::Kind::configure) return hardware_->set_rate(step.rate);
    going_ = step.out;
    if (!going_.empty()) hardware_->transmit(going_[0]);
  }
  void result(bool) {}

 private:
  Hardware* hardware_;
  host::Carrier<CanFrame, CanFifo> carrier_;
  std::span<const CanFrame> going_{};
};

}  // namespace absenc::firmware
