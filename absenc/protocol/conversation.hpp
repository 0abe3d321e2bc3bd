// SPDX-License-Identifier: Apache-2.0
// The two roles a unit plays: conversations (host side) and virtual encoders (device side). Both are machines.
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

/// The last request and what came back, kept so that nobody has to reproduce a bad frame to see it.
template <class Item>
struct Exchange {
  std::span<const Item> sent{};      ///< Items that were sent.
  std::span<const Item> received{};  ///< Items that were received.
  Time sent_at{};                    ///< end of the last bit sent
  Time received_at{};                ///< end of the last bit received; sent_at when nothing came
};

/// An error in words: more than its own text has. Either may be empty.
struct Explanation {
  std::string_view detail{};  ///< which step failed, what was found
  std::string_view advice{};  ///< what to do, in place of the error's own advice
};

/// What a conversation has taken from an encoder that transmits by itself.
struct StreamCounts {
  /// Frames so far that were damaged, or could not be told from damaged ones, whether an error reported them or not.
  std::uint64_t discarded = 0;
};

/// Tells whether a conversation has sent a request that changes the encoder.
enum class ChangeSent : std::uint8_t {
  no,
  yes,      ///< or it may have been
  refused,  ///< and the encoder said, or showed when it was read back, that it is as it was
};

/// Host side. At `emit` and `done` the accessors describe the result; they stay valid until the next feed.
template <class Item>
struct Conversation : Machine<Item> {
  /// `none`, or why there is no result. After `done` it tells how the whole procedure ended.
  [[nodiscard]] virtual Error error() const = 0;
  /// More than the error's own text, for people: which step failed, what was found. May be empty.
  [[nodiscard]] virtual std::string_view detail() const { return {}; }
  /// What to do about the error, where there is something better than its own advice. May be empty.
  [[nodiscard]] virtual std::string_view advice() const { return {}; }
  /// The position, when the result is one and there was no error; otherwise null.
  [[nodiscard]] virtual const Reading* reading() const { return nullptr; }
  /// Null: it ends by itself. Else each `emit` is a result like that of `done`, and the next one follows for as long as
  /// this is driven.
  [[nodiscard]] virtual const StreamCounts* stream() const { return nullptr; }
  /// Returns whether the encoder sends without requests.
  [[nodiscard]] bool streams() const { return stream() != nullptr; }
  /// Of one that streams: whether it sends a request for each result. Then nothing came while it was not driven.
  [[nodiscard]] virtual bool asks() const { return false; }
  /// Every named value of the result. Nothing is put when there was an error.
  virtual void report(FieldSink& sink) const = 0;
  /// Returns the items of the last exchange.
  [[nodiscard]] virtual Exchange<Item> exchange() const = 0;
  /// Asks to end early, from the next step on: a conversation that changes the encoder for its own use leaves it as it
  /// was, ends by itself and returns true. The others ignore it: they may be left at any step.
  virtual bool abort() { return false; }
  /// Valid at every step, also when the port has thrown.
  [[nodiscard]] virtual ChangeSent change_sent() const { return ChangeSent::no; }
  /// Puts what such a conversation leaves changed when it cannot go on after this step.
  virtual void report_left(FieldSink&) const {}

 protected:
  ~Conversation() = default;
};

/// A timing or access rule that the host broke.
struct Violation {
  std::string_view rule;  ///< The rule, in words.
  Time at;                ///< Time at which the host broke it.
};

/// Is told of each look at whether the host keeps a rule: it did what the rule is about.
struct RuleWatch {
  /// Is called for each look at a rule, with whether the host kept it.
  virtual void looked(std::string_view rule, bool kept) = 0;

 protected:
  ~RuleWatch() = default;
};

/// Device side: a virtual encoder with its own memory, alarms and timing rules.
template <class Item>
struct Device : Machine<Item> {
  /// Whether the encoder runs its start-up, or is ready at once.
  enum class PowerOn : std::uint8_t {
    real,  ///< with the document's start-up time
    skip,  ///< ready at once
  };
  /// Switches the encoder on.
  virtual void power_on(Time now, PowerOn kind) = 0;
  /// Switches the encoder off.
  virtual void power_off(Time now) = 0;
  /// Raises the alarms of `bits` (of the unit's alarms field): latched ones until they are cleared by the host,
  /// the others until `lower_alarms`.
  virtual void raise_alarms(std::uint32_t bits) = 0;
  /// Ends the cause of alarms; latched alarms stay until a host clears them.
  virtual void lower_alarms(std::uint32_t bits) = 0;
  /// Sets the unit's condition of this index to `value`, within its range.
  virtual void set_condition(std::size_t /*index*/, std::int64_t /*value*/, Time /*now*/) {}
  /// Everything that survives power off. Write to it only while the encoder is off.
  [[nodiscard]] virtual MutableBytes memory() = 0;
  /// Counts up with every change of `memory`.
  [[nodiscard]] virtual std::uint32_t memory_version() const = 0;
  /// The first rules broken, in order; `violation_count` goes on counting when they no longer fit.
  [[nodiscard]] virtual std::span<const Violation> violations() const = 0;
  /// Returns how often the host broke a rule.
  [[nodiscard]] virtual std::uint32_t violation_count() const = 0;
  /// Null: nobody. `watch` must outlive the encoder.
  virtual void watch_rules(RuleWatch* /*watch*/) {}
  /// Requests answered so far.
  [[nodiscard]] virtual std::uint64_t answer_count() const = 0;

 protected:
  ~Device() = default;
};

}  // namespace absenc
