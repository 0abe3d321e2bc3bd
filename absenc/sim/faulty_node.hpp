// SPDX-License-Identifier: Apache-2.0
// A virtual node of a CAN bus that misbehaves on request: damages the frames that a device sends, and what it hears.
#pragma once

#include <deque>

#include "absenc/sim/faults.hpp"

namespace absenc::sim {

/// Stands between the bus and a device, which must outlive it. The faults are those of FaultRates, a frame in the place
/// of a reply: `drop` loses the last byte of one, `truncate` any number of them, `echo` sends what was heard last,
/// `garbage` a frame of random identifier and data before it. The checksum of CAN lets none of that through on a wire:
/// it is what a node with a mistake in its program sends.
class FaultyNode final : public Machine<CanFrame> {
 public:
  FaultyNode(Machine<CanFrame>& device, const FaultRates& rates, std::uint64_t seed);

  void feed(const Event<CanFrame>& event) override;
  Step<CanFrame> next(Time now) override;

  /// From the next frame on.
  void set_rates(const FaultRates& rates) { rates_ = rates; }
  /// How many faults of each kind were injected.
  [[nodiscard]] const FaultCounts& counts() const { return counts_; }
  /// Frames with at least one fault.
  [[nodiscard]] std::uint64_t damaged_frames() const { return damaged_; }

 private:
  bool strikes(FaultKind kind);
  void damage(const CanFrame& frame);
  void flip_bits(CanFrame& frame);

  Machine<CanFrame>& device_;
  FaultRates rates_;
  Random random_;
  FaultCounts counts_{};
  std::uint64_t damaged_ = 0;
  CanFrame last_heard_{};
  bool heard_ = false;
  std::vector<CanFrame> out_;
};

}  // namespace absenc::sim
