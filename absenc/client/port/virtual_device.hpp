// SPDX-License-Identifier: Apache-2.0
// A virtual encoder, made from the user's settings.
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
  std::optional<std::int64_t> singleturn;  // position within the turn at the start, in counts
  std::optional<std::int64_t> multiturn;   // number of turns at the start
  std::string motion = "still";
  std::vector<std::string> conditions;  // conditions, each as NAME=VALUE, set before power-on
  std::vector<std::string> alarms;      // names of alarms that are raised from the start
  std::vector<std::string> faults;      // faults to inject, each as KIND=RATE
  // whether the encoder is prepared for faults that are switched on only after the start
  bool faults_may_come = false;
  std::uint64_t seed = 1;  // seed of the random faults
  Time delay = sim::FaultRates{}.delay;
  bool real_power_on = false;  // whether the encoder, after power-on, takes as long to start as the document states
};

/// Parses a fault such as `corrupt=0.01`. Throws UsageError.
[[nodiscard]] sim::FaultRate require_fault(std::string_view text);

/// A virtual encoder, which is switched off until `power_on`.
class VirtualDevice {
 public:
  /// Makes the encoder. Throws UsageError for settings that the unit cannot have.
  VirtualDevice(const Unit& unit, const Options& options, const DeviceSettings& settings);
  VirtualDevice(const VirtualDevice&) = delete;
  VirtualDevice& operator=(const VirtualDevice&) = delete;

  /// Switches the encoder on, with its conditions and alarms, and starts the motion at `now`.
  void power_on(Time now);

  // ---- Only the thread of the encoder's machine may call these functions.

  [[nodiscard]] const Options& options() const { return options_; }
  [[nodiscard]] bool is_on() const { return is_on_; }
  /// Switches the encoder on; with `real` it starts up as slowly as the document states.
  void switch_on(Time now, bool real);
  void switch_off(Time now);
  /// Raise or lower alarms, given as bits of the unit's alarms.
  void raise_alarms(std::uint32_t bits);
  void lower_alarms(std::uint32_t bits);
  /// Sets a condition of the encoder, as its temperature, to `value`, which must be in the condition's range.
  void set_condition(std::size_t index, std::int64_t value, Time now);
  [[nodiscard]] std::int64_t condition(std::size_t index) const { return conditions_[index]; }

  /// Sets the observer of rule checks, which must outlive the device; null: none.
  void watch_rules(RuleWatch* watch);

  /// Sets the rates of all faults from now on. Faults must be enabled: by `faults_may_come`, or by faults at the start.
  void set_faults(const sim::FaultRates& rates);
  [[nodiscard]] const sim::FaultRates& fault_rates() const { return rates_; }

  [[nodiscard]] const Any<Device>& device() const { return device_; }
  /// Return the machine that is connected to the line. `bytes()` is null on CAN, `frames()` is null on all other lines.
  [[nodiscard]] Machine<std::uint8_t>* bytes() const;
  [[nodiscard]] Machine<CanFrame>* frames() const;
  /// Returns how often each fault was injected; null if faults were never enabled.
  [[nodiscard]] const sim::FaultCounts* faults() const;
  /// Returns how many replies had a fault such as a delay; nothing on CAN, or if faults were never enabled.
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
  std::uint32_t alarms_ = 0;  // bits of the alarms that are raised at the start
  bool real_power_on_;
  bool is_on_ = false;
};

}  // namespace absenc::client
