// SPDX-License-Identifier: Apache-2.0
// A virtual CAN node with injected faults in the frames that it sends or receives.
#pragma once

#include <deque>

#include "absenc/sim/faults.hpp"

namespace absenc::sim {

/// A machine that stands between a CAN bus and a device, and injects faults. The device must outlive it. The faults are
/// like those of FaultRates, with a frame in place of a reply. They model a node with faulty software: on a real bus
/// the CAN checksum would discard frames damaged on the wire.
class FaultyNode final : public Machine<CanFrame> {
 public:
  /// Injects faults between `device` and its bus. The same seed gives the same faults.
  FaultyNode(Machine<CanFrame>& device, const FaultRates& rates, std::uint64_t seed);

  /// Processes an event that the port reports.
  void feed(const Event<CanFrame>& event) override;
  /// Returns the next step that the port must carry out.
  Step<CanFrame> next(Time now) override;

  /// Sets the probabilities of faults, from the next frame on.
  void set_rates(const FaultRates& rates) { rates_ = rates; }
  /// Returns the number of injected faults of each kind, indexed by FaultKind.
  [[nodiscard]] const FaultCounts& counts() const { return counts_; }
  /// Returns the number of the device's transfers with at least one fault; `request_corrupt` does not count.
  [[nodiscard]] std::uint64_t damaged_frames() const { return damaged_; }

 private:
  bool strikes(FaultKind kind);
  void damage(const CanFrame& frame);

  Machine<CanFrame>& device_;
  FaultRates rates_;
  Random random_;
  FaultCounts counts_{};
  std::uint64_t damaged_ = 0;
  CanFrame last_received_{};
  bool has_received_ = false;
  std::vector<CanFrame> out_;
};

}  // namespace absenc::sim
