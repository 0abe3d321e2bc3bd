// SPDX-License-Identifier: Apache-2.0
// Host side of a CAN bus: sends a frame and receives all frames for a time, among the traffic of other nodes. It knows
// no protocol, and is compiled once.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/author/routine.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::author {

/// How long a host waits for an answer.
struct CanHostTimes {
  Time answer_limit{};  ///< time without any frame on the bus
  Time busy_limit{};    ///< time on a bus that other nodes keep busy
};

/// Sends one frame at a time and receives the frames after it; a subclass decides which frame is sent next. Frames that
/// were complete before the request are not delivered to the subclass.
class CanEngine : public Conversation<CanFrame> {
 public:
  /// Takes an event of the port.
  void feed(const Event<CanFrame>& event) final;
  /// Returns the next step of the port.
  Step<CanFrame> next(Time now) final;
  /// Puts nothing: see Engine.
  void report(FieldSink&) const override {}
  [[nodiscard]] Error error() const final { return outcome_.error; }
  [[nodiscard]] std::string_view detail() const override { return outcome_.detail; }
  [[nodiscard]] std::string_view advice() const override { return outcome_.advice; }
  /// Returns the items of the last exchange.
  [[nodiscard]] Exchange<CanFrame> exchange() const final {
    return {{&request_, has_request_ ? 1u : 0u}, {&relevant_, has_relevant_ ? 1u : 0u}, sent_at_, relevant_at_};
  }

  /// Returns when the last frame was sent.
  [[nodiscard]] Time sent_at() const { return sent_at_; }
  /// Returns whether frames were destroyed on the bus since the last request.
  [[nodiscard]] bool is_disturbed() const { return disturbed_; }
  /// Returns why no answer was received: timeout, or bad_framing on a bus with errors.
  [[nodiscard]] Error missing() const { return disturbed_ ? Error::bad_framing : Error::timeout; }
  /// Returns false: a node that sends without a pause still leaves the bus to others.
  [[nodiscard]] bool is_noisy() const { return false; }

 protected:
  CanEngine() = default;
  ~CanEngine() = default;

  /// Sends `frame`, `pause` after the last answer or request, and receives until the bus was silent for the answer
  /// limit.
  void ask(const CanFrame& frame, const CanHostTimes& times, Time pause = {});
  /// Sends `frame` and receives for exactly `duration`.
  void ask_for(const CanFrame& frame, Time duration);
  /// Delivers frames, from now on, that were received before the request was sent: they may answer earlier requests.
  void overhear(bool yes = true) { receives_early_ = yes; }
  /// Returns whether the delivered frame was received before the request was sent.
  [[nodiscard]] bool came_early() const { return early_; }
  /// Receives unsolicited frames for `duration`.
  void listen(Time duration);
  /// Switches the rate of this end of the line, then receives for `duration`.
  void configure(std::uint32_t rate, Time duration);
  /// Ends the conversation with this outcome.
  void finish(const Outcome& outcome);
  /// Stores the frame as the answer, for `exchange`.
  void keep(const CanFrame& frame, Time at);
  /// Returns whether a good reply needs no second one to be presented as good.
  [[nodiscard]] bool is_alone() const { return outcome_.alone; }

  /// Handles a frame that was received after the request. Calls one of the functions above, or returns to receive more.
  virtual void heard(const CanFrame& frame, Time at) = 0;
  /// Handles the end of the time limit. Calls one of the functions above.
  virtual void over() = 0;

 private:
  enum class State : std::uint8_t { ready, sending, beginning, receiving, configuring, over };
  void end();

  State state_ = State::over;
  bool has_request_ = false;
  bool has_relevant_ = false;
  bool disturbed_ = false;
  bool receives_early_ = false;
  bool early_ = false;
  std::uint32_t rate_ = 0;
  CanFrame request_{};
  CanFrame relevant_{};
  Time silence_{};   // time without any frame that ends receiving; 0: it lasts exactly `duration_`
  Time duration_{};  // longest time of receiving
  Time since_{};     // frames that were complete before this time are not delivered
  Time until_{};     // end of receiving; before that the time of sending
  Time sent_at_{};
  Time relevant_at_{};
  Outcome outcome_{};
};

}  // namespace absenc::author
