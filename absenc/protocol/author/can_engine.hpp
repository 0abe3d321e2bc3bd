// SPDX-License-Identifier: Apache-2.0
// Host side of a CAN bus: sends a frame, hears what comes for a time, among the traffic of others. It knows no
// protocol, and is compiled once.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/author/routine.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::author {

/// How long a host hears for an answer.
struct CanHostTimes {
  Time answer_limit{};  ///< without any frame on the bus
  Time busy_limit{};    ///< on a bus that others keep busy
};

/// One frame and what comes behind it at a time; a subclass decides what comes next. What was under way before is not
/// told to it.
class CanEngine : public Conversation<CanFrame> {
 public:
  /// Takes an event of the port.
  void feed(const Event<CanFrame>& event) final;
  /// Returns the next step of the port.
  Step<CanFrame> next(Time now) final;
  /// Nothing: see Engine.
  void report(FieldSink&) const override {}
  [[nodiscard]] Error error() const final { return outcome_.error; }
  [[nodiscard]] std::string_view detail() const override { return outcome_.detail; }
  [[nodiscard]] std::string_view advice() const override { return outcome_.advice; }
  /// Returns the items of the last exchange.
  [[nodiscard]] Exchange<CanFrame> exchange() const final {
    return {{&request_, has_request_ ? 1u : 0u}, {&relevant_, has_relevant_ ? 1u : 0u}, sent_at_, relevant_at_};
  }

  /// When the last frame had left.
  [[nodiscard]] Time sent_at() const { return sent_at_; }
  /// Whether frames were destroyed on the bus since what was asked last.
  [[nodiscard]] bool is_disturbed() const { return disturbed_; }
  /// Why no answer came: timeout, or bad_framing on a bus with errors.
  [[nodiscard]] Error missing() const { return disturbed_ ? Error::bad_framing : Error::timeout; }
  /// Never: whoever sends without a pause leaves the bus to others all the same.
  [[nodiscard]] bool is_noisy() const { return false; }

 protected:
  CanEngine() = default;
  ~CanEngine() = default;

  /// Sends `frame`, `pause` after the last answer or request, and hears until nothing has come for the answer limit.
  void ask(const CanFrame& frame, const CanHostTimes& times, Time pause = {});
  /// Sends `frame` and hears for exactly so long.
  void ask_for(const CanFrame& frame, Time duration);
  /// From here on what comes before a frame that is asked has left is told too: answers to those before it.
  void overhear(bool yes = true) { overhears_ = yes; }
  /// Whether the frame that is being told is such a one.
  [[nodiscard]] bool came_early() const { return early_; }
  /// Hears what is sent unsolicited.
  void listen(Time duration);
  /// Switches this end of the line, then hears for `duration`.
  void configure(std::uint32_t rate, Time duration);
  /// Ends the conversation with this outcome.
  void finish(const Outcome& outcome);
  /// Keeps the frame as the answer, for `exchange`.
  void keep(const CanFrame& frame, Time at);
  /// Returns whether a good reply needs no second one to be presented as good.
  [[nodiscard]] bool is_alone() const { return outcome_.alone; }

  /// A frame came, after what was asked. Calls one of those, or goes on hearing.
  virtual void heard(const CanFrame& frame, Time at) = 0;
  /// The time is over. Calls one of those.
  virtual void over() = 0;

 private:
  enum class State : std::uint8_t { ready, sending, beginning, hearing, configuring, over };
  void end();

  State state_ = State::over;
  bool has_request_ = false;
  bool has_relevant_ = false;
  bool disturbed_ = false;
  bool overhears_ = false;
  bool early_ = false;
  std::uint32_t rate_ = 0;
  CanFrame request_{};
  CanFrame relevant_{};
  Time silence_{};   // without any frame, that ends hearing; 0: it is heard for exactly `duration_`
  Time duration_{};  // of hearing, at the most
  Time since_{};     // what was complete before is not told
  Time until_{};     // of hearing its end; before that when to send
  Time sent_at_{};
  Time relevant_at_{};
  Outcome outcome_{};
};

}  // namespace absenc::author
