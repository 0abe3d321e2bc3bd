// SPDX-License-Identifier: Apache-2.0
// A virtual RAA38S6 on CAN, as the document describes it.
#pragma once

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/host_rules.hpp"
#include "absenc/protocol/raa38/can/frame.hpp"
#include "absenc/protocol/raa38/settings.hpp"

namespace absenc::raa38::can {

/// A virtual RAA38S6 on a CAN bus.
class VirtualNode final : public Device<CanFrame> {
 public:
  /// Creates a node that is off until `power_on`. `shaft` must outlive it.
  VirtualNode(const Format& format, const Shaft& shaft)
      : format_(format), settings_(format.node, rates[format.rate].index, format.bits, shaft) {}

  /// Handles received frames and the end of a sent one; ignores other events.
  void feed(const Event<CanFrame>& event) override;
  /// Returns what the port must do next, such as send or wait.
  Step<CanFrame> next(Time now) override;

  /// Switches the encoder on.
  void power_on(Time now, PowerOn kind) override;
  /// Switches the encoder off.
  void power_off(Time now) override;
  void raise_alarms(std::uint32_t) override {}
  /// Does nothing: this encoder reports no alarms.
  void lower_alarms(std::uint32_t) override {}
  [[nodiscard]] MutableBytes memory() override { return settings_.memory(); }
  [[nodiscard]] std::uint32_t memory_version() const override { return settings_.version(); }
  [[nodiscard]] std::span<const Violation> violations() const override { return rules_.violations(); }
  /// Returns how often the host broke a rule that the node checks.
  [[nodiscard]] std::uint32_t violation_count() const override { return rules_.violation_count(); }
  void watch_rules(RuleWatch* watch) override { rules_.watch(watch); }
  [[nodiscard]] std::uint64_t answer_count() const override { return answer_count_; }

  /// Returns the settings in the node's memory.
  [[nodiscard]] const Settings& settings() const { return settings_; }
  /// Returns the stored node number.
  [[nodiscard]] std::uint8_t node() const { return settings_.number(); }
  /// Returns the stored bit rate in bits per second.
  [[nodiscard]] std::uint32_t rate() const { return rate_of_index(settings_.rate())->bits_per_second; }

 private:
  struct Pending {
    CanFrame frame;
    Time at;
  };

  void receive(const CanFrame& frame, Time at);
  void execute(const OrderInfo& info, std::uint8_t value, Time at);
  void configure(const OrderInfo& info, std::uint8_t value, Time at);
  void start_cyclic(std::uint8_t readings_per_s, Time from);
  void answer(const CanFrame& frame, Time at);
  void wrote(bool changed, Time at);
  [[nodiscard]] Time period() const;

  Format format_;
  Settings settings_;

  bool powered_ = false;
  bool configuring_ = false;  // whether the node is in configuration mode
  bool sending_ = false;
  bool switch_rate_ = false;   // whether the bit rate changes after the last pending answer
  bool rate_changed_ = false;  // whether the next step must set the port to the new bit rate
  std::uint8_t readings_per_s_ = 0;
  Time next_cyclic_ = never;
  Buffer<Pending, 8> pending_;  // answers that are not sent yet, the earliest first
  CanFrame out_{};
  std::uint64_t answer_count_ = 0;
  HostRules rules_;
};

}  // namespace absenc::raa38::can
