// SPDX-License-Identifier: Apache-2.0
// The machines of protocol units: conversations (host side) and virtual encoders (device side).
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

/// The last request of a conversation, and the items received after it; both may be empty.
template <class Item>
struct Exchange {
  std::span<const Item> sent{};      ///< Bytes or CAN frames of the request.
  std::span<const Item> received{};  ///< Bytes or CAN frames that were received after the request, valid or not.
  Time sent_at{};                    ///< time at which the last bit of the request ended, or the request pulse began
  Time received_at{};  ///< time at which the last received bit ended; if nothing was received, the end of the request
};

/// Two texts for people that explain an error; either may be empty.
struct Explanation {
  std::string_view detail{};  ///< the step of the command that failed, and the evidence for this
  std::string_view advice{};  ///< advice to the user, which replaces the general advice of the error
};

/// Counts of a conversation that streams: each of its steps `emit` gives a result.
struct StreamCounts {
  /// Estimated number of frames that were received damaged.
  std::uint64_t discarded = 0;
};

/// Whether a conversation has sent a request that changes the encoder.
enum class ChangeSent : std::uint8_t {
  no,
  yes,       ///< a request that changes the encoder was sent, or possibly sent
  refused,   ///< such a request (see `yes`) was sent, but the encoder refused it, or reading back shows no change
  unproven,  ///< such a request was sent; what is read back would be the same if the encoder had ignored it
};

/// Host side of one command. Its result, at the step `emit` or `done`, is valid until the next call of `feed` or
/// `next`.
template <class Item>
struct Conversation : Machine<Item> {
  /// Returns why there is no result; `Error::none` if there is one.
  [[nodiscard]] virtual Error error() const = 0;
  /// Returns a text for people that adds to the error's own text; it may be empty.
  [[nodiscard]] virtual std::string_view detail() const { return {}; }
  /// Returns advice for people that replaces the error's general advice; empty: none.
  [[nodiscard]] virtual std::string_view advice() const { return {}; }
  /// Returns the position that is the result; null: there is none.
  [[nodiscard]] virtual const Reading* reading() const { return nullptr; }
  /// Returns the counts of a conversation whose every `emit` is a result; null: it does not stream.
  [[nodiscard]] virtual const StreamCounts* stream() const { return nullptr; }
  /// Returns whether the conversation streams, as `stream` describes.
  [[nodiscard]] bool streams() const { return stream() != nullptr; }
  /// Returns whether a conversation that streams sends a request for each result.
  [[nodiscard]] virtual bool asks() const { return false; }
  /// Returns the position that the last reply carried. The Reading has no bits if the reply carried no position, or if
  /// this conversation does not report it.
  [[nodiscard]] virtual Reading carried() const { return {}; }
  /// Puts every named value of the result into `sink`; nothing after an error.
  virtual void report(FieldSink& sink) const = 0;
  /// Returns the last request and the items received after it.
  [[nodiscard]] virtual Exchange<Item> exchange() const = 0;
  /// Asks the conversation to end early. Returns true if it first restores the encoder and then ends by itself.
  virtual bool abort() { return false; }
  /// Returns whether a request that changes the encoder was sent; valid at every step.
  [[nodiscard]] virtual ChangeSent change_sent() const { return ChangeSent::no; }
  /// Returns a text for people on what the change did besides, or why its result is unknown; empty: there is nothing.
  [[nodiscard]] virtual std::string_view change_note() const { return {}; }
  /// Puts fields into `sink` for the changes of the encoder that remain if the conversation ends now; by default none.
  virtual void report_left(FieldSink&) const {}

 protected:
  ~Conversation() = default;
};

/// A timing or access rule that the host broke.
struct Violation {
  std::string_view rule;  ///< The broken rule, in words.
  Time at;                ///< Time at which the host broke the rule.
};

/// An observer that is notified each time a virtual encoder checks a rule.
struct RuleWatch {
  /// Is called for each check of `rule`. `kept`: whether the host kept the rule.
  virtual void looked(std::string_view rule, bool kept) = 0;

 protected:
  ~RuleWatch() = default;
};

/// Device side: a virtual encoder with its own memory, alarms and timing rules.
template <class Item>
struct Device : Machine<Item> {
  /// How long the encoder takes to be ready after it is switched on.
  enum class PowerOn : std::uint8_t {
    real,  ///< the encoder needs its start-up time, which its document states or which is assumed
    skip,  ///< the encoder is ready at once
  };
  /// Switches the encoder on at `now`.
  virtual void power_on(Time now, PowerOn kind) = 0;
  /// Switches the encoder off at `now`.
  virtual void power_off(Time now) = 0;
  /// Raises the alarms `bits` of the unit's alarm field.
  virtual void raise_alarms(std::uint32_t bits) = 0;
  /// Ends raised alarms, even latched ones; one that a condition causes may stay.
  virtual void lower_alarms(std::uint32_t bits) = 0;
  /// Sets the condition Unit::conditions[index] to `value`, which is within its range.
  virtual void set_condition(std::size_t /*index*/, std::int64_t /*value*/, Time /*now*/) {}
  /// Returns the memory of the encoder that survives power off; writable only while it is off.
  [[nodiscard]] virtual MutableBytes memory() = 0;
  /// Returns a number that the encoder increments with every change that it makes to `memory`.
  [[nodiscard]] virtual std::uint32_t memory_version() const = 0;
  /// Returns the first rule breaches of the host in order of time, as many as the encoder stores (HostRules: 16).
  [[nodiscard]] virtual std::span<const Violation> violations() const = 0;
  /// Returns how often the host broke a rule.
  [[nodiscard]] virtual std::uint32_t violation_count() const = 0;
  /// Sets the observer of rule checks, which must outlive the encoder; null: none.
  virtual void watch_rules(RuleWatch* /*watch*/) {}
  /// Returns how many requests or transfers the encoder has served; unsolicited frames may count too.
  [[nodiscard]] virtual std::uint64_t answer_count() const = 0;

 protected:
  ~Device() = default;
};

}  // namespace absenc
