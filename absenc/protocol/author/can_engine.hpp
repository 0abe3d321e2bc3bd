// SPDX-License-Identifier: Apache-2.0
// Host side of a CAN bus: sends a frame, and receives all frames on the bus for a time.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/author/routine.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::author {

/// How long a host waits for an answer on a CAN bus.
struct CanHostTimes {
  Time answer_limit{};  ///< time without any frame on the bus after which the host stops waiting
  Time busy_limit{};    ///< time after which the host stops waiting although other nodes keep the bus busy
};

/// Conversation that sends one frame at a time and receives frames; a subclass decides which frames to send.
class CanEngine : public Conversation<CanFrame> {
 public:
  /// Not copyable: requests and replies are views into the conversation itself.
  CanEngine(const CanEngine&) = delete;
  CanEngine& operator=(const CanEngine&) = delete;

  /// Handles an event that the port reports.
  void feed(const Event<CanFrame>& event) final;
  /// Returns the next step that the port must take.
  Step<CanFrame> next(Time now) final;
  /// Puts no fields of a result; the subclass Reported (command.hpp) overrides this function and puts them.
  void report(FieldSink&) const override {}
  [[nodiscard]] Error error() const final { return outcome_.error; }
  [[nodiscard]] std::string_view detail() const override { return outcome_.detail; }
  [[nodiscard]] std::string_view advice() const override { return outcome_.advice; }
  /// Returns the last request, and the frame that `keep` stored as its answer.
  [[nodiscard]] Exchange<CanFrame> exchange() const final {
    return {{&request_, has_request_ ? 1u : 0u},
            {&relevant_, has_relevant_ ? 1u : 0u},
            has_request_ ? sent_at_ : relevant_at_,
            relevant_at_};
  }

  /// Returns the time of the `sent` event of the last request.
  [[nodiscard]] Time sent_at() const { return sent_at_; }
  /// Returns whether a bus error was reported since the last request or `listen`.
  [[nodiscard]] bool is_disturbed() const { return disturbed_; }
  /// Returns why no answer was received: timeout, or bad_framing on a bus with errors.
  [[nodiscard]] Error missing() const { return disturbed_ ? Error::bad_framing : Error::timeout; }
  /// Returns false: on a CAN bus, frames without a pause are not treated as noise.
  [[nodiscard]] bool is_noisy() const { return false; }

 protected:
  CanEngine() = default;
  ~CanEngine() = default;

  /// Sets that `frame` is sent next, at least `pause` after the answer that `keep` stored for the last request or, if
  /// it stored none, after that request. `times` limit how long frames are then received.
  void ask(const CanFrame& frame, const CanHostTimes& times, Time pause = {});
  /// Sets that `frame` is sent next, and that frames are then received for `duration`.
  void ask_for(const CanFrame& frame, Time duration);
  /// Sets whether frames that were complete before the request was sent or `listen` began are delivered, too.
  void overhear(bool yes = true) { receives_early_ = yes; }
  /// Returns whether the delivered frame was complete before the request was sent or `listen` began.
  [[nodiscard]] bool came_early() const { return early_; }
  /// Sets that frames are received next for `duration` without sending.
  void listen(Time duration);
  /// Sets that this end of the bus changes to `rate` bits per second, and listens for `duration`.
  void configure(std::uint32_t rate, Time duration);
  /// Ends the conversation with the error and texts of `outcome`.
  void finish(const Outcome& outcome);
  /// Stores `frame`, which was complete at `at`, as the answer to the request, for `exchange`.
  void keep(const CanFrame& frame, Time at);
  /// Returns whether the texts of the outcome stand alone, without the unit's explanation of the last reply; see
  /// `only`.
  [[nodiscard]] bool is_alone() const { return outcome_.alone; }

  /// Handles a received frame, which was complete at `at`.
  virtual void heard(const CanFrame& frame, Time at) = 0;
  /// Handles the end of receiving: a time limit has passed. The conversation ends unless this function continues it.
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
  bool listens_ = false;  // true: the host only receives frames, without a request
  std::uint32_t rate_ = 0;
  CanFrame request_{};
  CanFrame relevant_{};
  Time silence_{};   // receiving ends after this time without any frame; 0: receiving lasts exactly `duration_`
  Time duration_{};  // longest duration of receiving
  Time since_{};     // frames that were complete before this time are delivered only after `overhear`
  Time until_{};     // time at which receiving ends or, before the request is sent, earliest time to send the request
  Time sent_at_{};
  Time relevant_at_{};
  Outcome outcome_{};
};

}  // namespace absenc::author
