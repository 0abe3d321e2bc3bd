// SPDX-License-Identifier: Apache-2.0
// A virtual encoder as the user asked for it: shaft, starting position, alarms and faults around the unit's device.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"
#include "absenc/sim/faults.hpp"
#include "absenc/sim/faulty_node.hpp"
#include "absenc/sim/motion.hpp"

namespace absenc::client {

struct DeviceSettings {
  std::optional<std::int64_t> singleturn;  // counts at the start
  std::optional<std::int64_t> multiturn;   // revolutions at the start
  std::string motion = "still";
  std::vector<std::string> conditions;  // NAME=VALUE, set before it is switched on
  std::vector<std::string> alarms;      // raised from the start
  std::vector<std::string> faults;      // KIND=RATE
  bool faults_may_come = false;         // while it runs, also without any at the start
  std::uint64_t seed = 1;               // of the faults
  Time delay = sim::FaultRates{}.delay;
  bool real_power_on = false;  // with the document's start-up time
};

/// Of `corrupt=0.01`. Throws UsageError, which names the kinds and the range of a rate.
[[nodiscard]] sim::FaultRate require_fault(std::string_view text);

/// Switched off until `power_on`.
class VirtualDevice {
 public:
  /// Throws UsageError for settings that the unit cannot have.
  VirtualDevice(const Unit& unit, const Options& options, const DeviceSettings& settings);
  VirtualDevice(const VirtualDevice&) = delete;
  VirtualDevice& operator=(const VirtualDevice&) = delete;

  /// The shaft begins to move at `now`, the conditions are set, the power comes, and the alarms are raised.
  void power_on(Time now);

  // ---- What happens to it while it runs. Not from another thread than that of its machine.

  /// As they were at the start.
  [[nodiscard]] const Options& options() const { return options_; }
  [[nodiscard]] bool is_on() const { return is_on_; }
  /// `real`: with the document's start-up time. Nothing, when it is on.
  void switch_on(Time now, bool real);
  void switch_off(Time now);
  /// Bits of the unit's alarms.
  void raise_alarms(std::uint32_t bits);
  void lower_alarms(std::uint32_t bits);
  /// `index` among the unit's conditions; `value` within its range.
  void set_condition(std::size_t index, std::int64_t value, Time now);
  [[nodiscard]] std::int64_t condition(std::size_t index) const { return conditions_[index]; }

  /// Null: nobody. `watch` must outlive it.
  void watch_rules(RuleWatch* watch);

  /// From its next reply on. Only with `faults_may_come`, or where there were faults at the start.
  void set_faults(const sim::FaultRates& rates);
  [[nodiscard]] const sim::FaultRates& fault_rates() const { return rates_; }

  [[nodiscard]] const Any<Device>& device() const { return device_; }
  /// What stands on the line: the device, or the device with its faults. Exactly one is set.
  [[nodiscard]] Machine<std::uint8_t>* bytes() const;
  [[nodiscard]] Machine<CanFrame>* frames() const;
  /// What was injected; null where no fault was ever asked for.
  [[nodiscard]] const sim::FaultCounts* faults() const;
  /// Replies with at least one fault; none where frames are sent, or no fault was ever asked for.
  [[nodiscard]] std::optional<std::uint64_t> damaged_replies() const;

 private:
  template <class Use>
  void each(Use use);

  Options options_;
  sim::Motion motion_;
  std::unique_ptr<std::byte[]> storage_;
  Any<Device> device_;
  std::unique_ptr<sim::FaultyDevice> faulty_;
  std::unique_ptr<sim::FaultyNode> faulty_node_;
  sim::FaultRates rates_;
  bool had_faults_;
  std::vector<std::int64_t> conditions_;
  std::uint32_t alarms_ = 0;  // raised at the start
  bool real_power_on_;
  bool is_on_ = false;
};

}  // namespace absenc::client
