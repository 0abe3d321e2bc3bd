// SPDX-License-Identifier: Apache-2.0
// Base of virtual encoders on lines of characters and on clocked lines.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/host_rules.hpp"

namespace absenc::author {

/// A virtual encoder with power, alarms, rule checks and counters. Subclasses receive and send on a line.
template <class Item>
class EncoderOn : public Device<Item> {
 public:
  /// Switches the encoder on at `now`. It is ready after the start-up time or, with PowerOn::skip, at once.
  void power_on(Time now, typename Device<Item>::PowerOn kind) override {
    power_ = Power::starting;
    ready_at_ = kind == Device<Item>::PowerOn::skip ? now : now + start_time_;
    static_cast<void>(is_on(now));
  }
  /// Switches the encoder off at `now`.
  void power_off(Time now) override {
    if (is_on(now)) stopped(now);
    power_ = Power::off;
  }
  /// Raises the alarms `bits`, bits of the unit's alarm field.
  void raise_alarms(std::uint32_t bits) override { raised_ |= bits; }
  /// Ends the cause of the alarms `bits`. An encoder with latched alarms overrides this function.
  void lower_alarms(std::uint32_t bits) override { raised_ &= ~bits; }
  /// Returns a number that the encoder increments with every change that it makes to the memory.
  [[nodiscard]] std::uint32_t memory_version() const final { return memory_version_; }
  /// Returns the rule breaches of the host in order of time, as far as there is room; later ones are only counted.
  [[nodiscard]] std::span<const Violation> violations() const final { return rules_.violations(); }
  /// Returns how often the host broke a rule.
  [[nodiscard]] std::uint32_t violation_count() const final { return rules_.violation_count(); }
  /// Sets the observer of rule checks; null: none.
  void watch_rules(RuleWatch* watch) final { rules_.watch(watch); }
  /// Returns how many requests or transfers the encoder has served; unsolicited frames may count too.
  [[nodiscard]] std::uint64_t answer_count() const final { return answer_count_; }

 protected:
  /// Constructs an encoder that is off. `start_time`: from power on until requests are answered.
  explicit EncoderOn(Time start_time) : start_time_(start_time) {}
  ~EncoderOn() = default;

  /// Records whether the host kept a rule of the document, and returns `kept`.
  bool expect(bool kept, std::string_view rule, Time at) { return rules_.expect(kept, rule, at); }
  /// Notifies only the observer whether the host kept `rule`; a breach is not counted as a violation.
  void note(bool kept, std::string_view rule) { rules_.note(kept, rule); }
  /// Returns the recorder of rule breaches, for objects inside the encoder that check rules.
  [[nodiscard]] HostRules& rules() { return rules_; }
  /// Restarts the encoder, as a reset does: it ignores everything until the time `until`.
  void restart(Time until) {
    power_ = Power::starting;
    ready_at_ = until;
  }
  /// Returns whether the encoder is switched on and its start-up is over at `now`.
  [[nodiscard]] bool is_on(Time now) {
    if (power_ == Power::starting && now >= ready_at_) {
      power_ = Power::on;
      started(ready_at_);
    }
    return power_ == Power::on;
  }
  /// Returns the alarms that `raise_alarms` has raised and `lower_alarms` has not ended.
  [[nodiscard]] std::uint32_t raised() const { return raised_; }
  /// Increments `memory_version`; to be called after each change of the memory.
  void change_memory() { ++memory_version_; }
  /// Increments `answer_count`.
  void count_answer() { ++answer_count_; }

  /// Is called when the start-up of the encoder is over, with the time at which it ended.
  virtual void started(Time) {}
  /// Is called when an encoder that was ready is switched off, with the time of switching off.
  virtual void stopped(Time) {}

 private:
  enum class Power : std::uint8_t { off, starting, on };

  Time start_time_;
  Power power_ = Power::off;
  Time ready_at_{};
  std::uint32_t raised_ = 0;
  std::uint32_t memory_version_ = 0;
  HostRules rules_;
  std::uint64_t answer_count_ = 0;
};

}  // namespace absenc::author
