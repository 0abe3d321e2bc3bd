// SPDX-License-Identifier: Apache-2.0
// Base of every virtual encoder, on any line: power, alarms raised by tests and users, broken rules, number of answers.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/host_rules.hpp"

namespace absenc::author {

/// Power, alarms and watched rules, which all virtual encoders share.
template <class Item>
class EncoderOn : public Device<Item> {
 public:
  /// Switches the encoder on.
  void power_on(Time now, typename Device<Item>::PowerOn kind) override {
    power_ = Power::starting;
    ready_at_ = kind == Device<Item>::PowerOn::skip ? now : now + start_time_;
    static_cast<void>(is_on(now));
  }
  /// Switches the encoder off.
  void power_off(Time now) override {
    if (is_on(now)) stopped(now);
    power_ = Power::off;
  }
  /// Raises alarms.
  void raise_alarms(std::uint32_t bits) override { raised_ |= bits; }
  /// Ends the cause of alarms; latched alarms stay until a host clears them.
  void lower_alarms(std::uint32_t bits) override { raised_ &= ~bits; }
  /// Returns a number that changes with the memory.
  [[nodiscard]] std::uint32_t memory_version() const final { return memory_version_; }
  /// Returns the first rules that the host broke.
  [[nodiscard]] std::span<const Violation> violations() const final { return rules_.violations(); }
  /// Returns how often the host broke a rule.
  [[nodiscard]] std::uint32_t violation_count() const final { return rules_.violation_count(); }
  /// Sets the watch of rule checks; null: none.
  void watch_rules(RuleWatch* watch) final { rules_.watch(watch); }
  /// Returns the number of replies sent.
  [[nodiscard]] std::uint64_t answer_count() const final { return answer_count_; }

 protected:
  /// `start_time`: from power on to the first request that is answered.
  explicit EncoderOn(Time start_time) : start_time_(start_time) {}
  ~EncoderOn() = default;

  /// Records whether the host kept a rule of the document, and returns `kept`. A broken rule is a violation.
  bool expect(bool kept, std::string_view rule, Time at) { return rules_.expect(kept, rule, at); }
  /// Records the same for a rule whose breach is no violation: a host may break it, or may have given up.
  void note(bool kept, std::string_view rule) { rules_.note(kept, rule); }
  /// Ignores everything until `until`, as after a reset.
  void restart(Time until) {
    power_ = Power::starting;
    ready_at_ = until;
  }
  /// Returns whether the encoder is switched on and ready.
  [[nodiscard]] bool is_on(Time now) {
    if (power_ == Power::starting && now >= ready_at_) {
      power_ = Power::on;
      started(ready_at_);
    }
    return power_ == Power::on;
  }
  /// Returns the raised alarms.
  [[nodiscard]] std::uint32_t raised() const { return raised_; }
  /// Notes that the memory changed.
  void change_memory() { ++memory_version_; }
  /// Counts a reply.
  void count_answer() { ++answer_count_; }

  /// Called when power is on and the start-up over; the time is the end of the start-up.
  virtual void started(Time) {}
  /// Is called when the encoder is switched off.
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
