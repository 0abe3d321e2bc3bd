// SPDX-License-Identifier: Apache-2.0
// A virtual encoder as the user asked for it: shaft, starting position, alarms and faults around the unit's device.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absenc/protocol/unit.hpp"
#include "absenc/sim/faults.hpp"
#include "absenc/sim/faulty_node.hpp"
#include "absenc/sim/motion.hpp"

namespace absenc::tool {

struct DeviceSettings {
  std::optional<std::int64_t> singleturn;  // counts at the start
  std::optional<std::int64_t> multiturn;   // revolutions at the start
  std::string motion = "still";
  std::vector<std::string> alarms;  // raised from the start
  std::vector<std::string> faults;  // KIND=RATE
  std::uint64_t seed = 1;           // of the faults
  Time delay = sim::FaultRates{}.delay;
  bool real_power_on = false;  // with the document's start-up time
};

/// Switched off until `power_on`.
class VirtualDevice {
 public:
  /// Throws UsageError for settings that the unit cannot have.
  VirtualDevice(const Unit& unit, const Options& options, const DeviceSettings& settings);
  VirtualDevice(const VirtualDevice&) = delete;
  VirtualDevice& operator=(const VirtualDevice&) = delete;

  /// The shaft begins to move at `now`, the alarms are raised.
  void power_on(Time now);

  [[nodiscard]] const Any<Device>& device() const { return device_; }
  /// What stands on the line: the device, or the device with its faults. Exactly one is set.
  [[nodiscard]] Machine<std::uint8_t>* bytes() const;
  [[nodiscard]] Machine<CanFrame>* frames() const;
  /// What was injected; null without faults.
  [[nodiscard]] const sim::FaultCounts* faults() const;

 private:
  sim::Motion motion_;
  std::unique_ptr<std::byte[]> storage_;
  Any<Device> device_;
  std::unique_ptr<sim::FaultyDevice> faulty_;
  std::unique_ptr<sim::FaultyNode> faulty_node_;
  std::uint32_t alarms_ = 0;
  bool real_power_on_;
};

}  // namespace absenc::tool
