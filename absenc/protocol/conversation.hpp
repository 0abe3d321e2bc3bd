// SPDX-License-Identifier: Apache-2.0
// The two roles of a unit: conversations (host side) and virtual encoders (device side). Both are machines.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/core/angle.hpp"
#include "absenc/core/result.hpp"
#include "absenc/link/step.hpp"
#include "absenc/protocol/field.hpp"

namespace absenc {

/// The last request and the bytes received after it, stored so that a damaged frame can be shown without reproducing
/// it.
template <class Item>
struct Exchange {
  std::span<const Item> sent{};      ///< Items that were sent.
  std::span<const Item> received{};  ///< Items that were received.
  Time sent_at{};                    ///< end of the last sent bit
  Time received_at{};                ///< end of the last received bit; `sent_at` if none was received
};

/// Texts that explain an error better than its general text. Either may be empty.
struct Explanation {
  std::string_view detail{};  ///< which step failed, and the evidence
  std::string_view advice{};  ///< what to try, instead of the error's own advice
};

/// Counts of a conversation with an encoder that transmits unsolicited.
struct StreamCounts {
  /// Frames that were damaged, or cannot be told from damaged ones, whether an error reported them or not.
  std::uint64_t discarded = 0;
};

/// Whether a conversation has sent a request that changes the encoder.
enum class ChangeSent : std::uint8_t {
  no,
  yes,      ///< sent, or possibly sent
  refused,  ///< sent, but the encoder refused it, or reading back shows no change
};

/// Host side of one command. At `emit` and `done` its functions return the result, which is valid until the next feed.
template <class Item>
struct Conversation : Machine<Item> {
  /// Returns `none`, or why there is no result. After `done` it is the error of the whole procedure.
  [[nodiscard]] virtual Error error() const = 0;
  /// Returns the evidence for people, beyond the error's own text: the step that failed. May be empty.
  [[nodiscard]] virtual std::string_view detail() const { return {}; }
  /// Returns what to try, if there is something better than the error's own advice. May be empty.
  [[nodiscard]] virtual std::string_view advice() const { return {}; }
  /// Returns the position if the result is one; null after an error.
  [[nodiscard]] virtual const Reading* reading() const { return nullptr; }
  /// Returns the counts of a conversation that streams: each `emit` is a result like that of `done`, and the next one
  /// follows while it is driven. Null: it ends by itself.
  [[nodiscard]] virtual const StreamCounts* stream() const { return nullptr; }
  /// Returns whether the encoder sends without requests.
  [[nodiscard]] bool streams() const { return stream() != nullptr; }
  /// Returns whether a conversation that streams sends a request for each result. Nothing is received then while it is
  /// not driven.
  [[nodiscard]] virtual bool asks() const { return false; }
  /// Puts every named value of the result; nothing after an error.
  virtual void report(FieldSink& sink) const = 0;
  /// Returns the items of the last exchange.
  [[nodiscard]] virtual Exchange<Item> exchange() const = 0;
  /// Asks the conversation to end early, from the next step on. One that changes the encoder for its own use restores
  /// it, ends by itself and returns true. Others ignore it, because they may be abandoned at any step.
  virtual bool abort() { return false; }
  /// Returns whether the encoder may have changed. Valid at every step, also after an exception of the port.
  [[nodiscard]] virtual ChangeSent change_sent() const { return ChangeSent::no; }
  /// Puts the changes that such a conversation leaves behind if it cannot continue after this step.
  virtual void report_left(FieldSink&) const {}

 protected:
  ~Conversation() = default;
};

/// A timing or access rule that the host broke.
struct Violation {
  std::string_view rule;  ///< The rule, in words.
  Time at;                ///< Time at which the host broke it.
};

/// Is notified each time a virtual encoder checks a rule, because the host did what the rule is about.
struct RuleWatch {
  /// Called for each check of a rule, with whether the host kept it.
  virtual void looked(std::string_view rule, bool kept) = 0;

 protected:
  ~RuleWatch() = default;
};

/// Device side: a virtual encoder with its own memory, alarms and timing rules.
template <class Item>
struct Device : Machine<Item> {
  /// Whether the encoder runs its start-up, or is ready at once.
  enum class PowerOn : std::uint8_t {
    real,  ///< takes the start-up time of the document
    skip,  ///< is ready at once
  };
  /// Switches the encoder on.
  virtual void power_on(Time now, PowerOn kind) = 0;
  /// Switches the encoder off.
  virtual void power_off(Time now) = 0;
  /// Raises these alarms of the unit's alarm field. Latched alarms stay until the host clears them, others until
  /// `lower_alarms`.
  virtual void raise_alarms(std::uint32_t bits) = 0;
  /// Ends the cause of alarms; latched alarms stay until a host clears them.
  virtual void lower_alarms(std::uint32_t bits) = 0;
  /// Sets the unit's condition of this index to `value`, within its range.
  virtual void set_condition(std::size_t /*index*/, std::int64_t /*value*/, Time /*now*/) {}
  /// Returns the bytes that survive power off. Write them only while the encoder is off.
  [[nodiscard]] virtual MutableBytes memory() = 0;
  /// Returns a number that every change of `memory` increments.
  [[nodiscard]] virtual std::uint32_t memory_version() const = 0;
  /// Returns the first broken rules in order; `violation_count` also counts those that do not fit.
  [[nodiscard]] virtual std::span<const Violation> violations() const = 0;
  /// Returns how often the host broke a rule.
  [[nodiscard]] virtual std::uint32_t violation_count() const = 0;
  /// Sets the watch of rule checks; null: none. It must outlive the encoder.
  virtual void watch_rules(RuleWatch* /*watch*/) {}
  /// Returns how many requests were answered.
  [[nodiscard]] virtual std::uint64_t answer_count() const = 0;

 protected:
  ~Device() = default;
};

}  // namespace absenc
