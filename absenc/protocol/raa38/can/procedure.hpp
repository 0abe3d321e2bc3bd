// SPDX-License-Identifier: Apache-2.0
// What every conversation with RAA38S6 nodes does: sends a frame, hears what comes for a time, among the traffic of
// others.
#pragma once

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/raa38/can/fields.hpp"

namespace absenc::raa38::can {

using namespace std::chrono_literals;

// The document gives no times; these are far beyond what any controller needs.
inline constexpr Time answer_limit = 50ms;  // without any frame on the bus
inline constexpr Time busy_limit = 250ms;   // on a bus that others keep busy
inline constexpr Time slowest_period = 1s;  // of a node that sends by itself: TT = 1
inline constexpr Time listening_time = 1200ms;

/// How often a node sends by itself.
struct Cadence {
  unsigned count = 0;
  Time first{};
  Time last{};

  constexpr void add(Time at) {
    if (count++ == 0) first = at;
    last = at;
  }
  /// Mean, 0 with fewer than two frames.
  [[nodiscard]] constexpr Time period() const { return count < 2 ? Time{} : (last - first) / (count - 1); }
  /// Rounded; 1 for a single frame.
  [[nodiscard]] constexpr unsigned per_second() const {
    if (count == 0) return 0;
    const Time mean = period();
    if (mean <= Time{}) return 1;
    const auto rate = static_cast<unsigned>((Time(1s) + mean / 2) / mean);
    return rate < 1 ? 1 : rate > 255 ? 255 : rate;
  }
};

/// One frame and what comes behind it at a time; a subclass decides what comes next. What was under way before is not
/// told to it.
class Procedure : public Conversation<CanFrame> {
 public:
  void feed(const Event<CanFrame>& event) final;
  Step<CanFrame> next(Time now) final;
  [[nodiscard]] Error error() const final { return error_; }
  [[nodiscard]] std::string_view detail() const final { return explanation_.found; }
  [[nodiscard]] std::string_view advice() const final { return explanation_.advice; }
  [[nodiscard]] Exchange<CanFrame> exchange() const final {
    return {{&request_, has_request_ ? 1u : 0u}, {&relevant_, has_relevant_ ? 1u : 0u}, sent_at_, relevant_at_};
  }

 protected:
  ~Procedure() = default;

  /// Sends `frame`, `pause` after what came last, and hears until nothing has come for `answer_limit`.
  void ask(const CanFrame& frame, Time pause = {});
  /// Sends `frame` and hears for exactly so long.
  void ask_for(const CanFrame& frame, Time duration);
  /// Hears what is sent unasked.
  void listen(Time duration);
  /// Switches this end of the line, then hears for `duration`.
  void configure(std::uint32_t rate, Time duration);
  void finish(Error error = Error::none, const Explanation& explanation = {});
  /// Why a frame with such an error is not taken, or why none came.
  void fail(Error error);
  /// Keeps the frame as the answer, for `exchange`.
  void keep(const CanFrame& frame, Time at);

  /// A frame came, after what was asked. Calls `ask`, `listen` or `finish`, or goes on hearing.
  virtual void heard(const CanFrame& frame, Time at) = 0;
  /// The time is over. Calls one of them.
  virtual void over() = 0;

  /// When the last frame had left.
  [[nodiscard]] Time sent_at() const { return sent_at_; }
  /// Whether frames were destroyed on the bus since what was asked last.
  [[nodiscard]] bool disturbed() const { return disturbed_; }
  /// timeout, or bad_framing on a bus with errors.
  [[nodiscard]] Error missing() const { return disturbed_ ? Error::bad_framing : Error::timeout; }

 private:
  enum class State : std::uint8_t { ready, sending, hearing, configuring, done };

  State state_ = State::done;
  CanFrame request_{};
  CanFrame relevant_{};
  bool has_request_ = false;
  bool has_relevant_ = false;
  bool exact_ = false;  // hears for exactly `duration_`
  bool disturbed_ = false;
  bool started_ = false;
  Time pause_{};
  Time duration_{};
  LineSettings settings_{};
  Time now_{};
  Time since_{};  // what was complete before is not told
  Time until_{};
  Time sent_at_{};
  Time relevant_at_{};
  Error error_ = Error::none;
  Explanation explanation_{};
};

/// What a frame with such an error shows, and what to do.
[[nodiscard]] Explanation explain_frame(Error error, const CanFrame* request, const CanFrame* reply);

/// Whether the frame has the identifier of this node's replies.
[[nodiscard]] constexpr bool is_from(const CanFrame& frame, std::uint8_t node) {
  return function_of(frame) == Function::reply && node_of(frame) == node;
}

}  // namespace absenc::raa38::can
