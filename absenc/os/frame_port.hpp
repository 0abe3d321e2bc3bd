// SPDX-License-Identifier: Apache-2.0
// Steps and events (link/step.hpp) over anything that carries CAN frames: the timing that all such ports share.
#pragma once

#include <deque>

#include "absenc/link/port.hpp"
#include "absenc/os/waiting.hpp"

namespace absenc::os {

/// Every function throws Failure, Interrupted (os/signals.hpp) or Ended.
///
/// A transfer begins at `at`, never earlier; `begin` blocks until then. What came before it, or before `now` was
/// called, is told with a time that is not later: a conversation can leave it aside, however long it waited in a queue,
/// because answers on CAN carry no number. `sent` carries the time before the frame was handed over, because nothing
/// tells when the controller got it through: an answer is never older. `timer` is reported as by StreamPort.
class FramePort : public Port<CanFrame> {
 public:
  FramePort() = default;
  FramePort(const FramePort&) = delete;
  FramePort& operator=(const FramePort&) = delete;
  virtual ~FramePort() = default;

  [[nodiscard]] Time now() final;
  void begin(const Step<CanFrame>& step) final;
  [[nodiscard]] Event<CanFrame> wait(const Step<CanFrame>& step) final;

  /// What the way between the bus and this program adds to the answer and gap limits of a step.
  [[nodiscard]] Time latency() const { return latency_; }
  void set_latency(Time latency) { latency_ = latency; }

  /// A transfer due within `slack` is sent at once. 0 at first.
  void set_send_slack(Time slack) { send_slack_ = slack; }

  /// From `end` on the port throws Ended. `never` at first.
  void set_end(Time end) { end_ = end; }

 protected:
  /// Pushes what has come; blocks until there is something or `deadline` has come. Does not block when that lies
  /// behind.
  virtual void collect(Time deadline) = 0;
  virtual void send(const CanFrame& frame) = 0;
  virtual void apply(const LineSettings& settings) = 0;

  void push(const CanFrame& frame, Time at);
  /// A frame was destroyed on the bus.
  void push_error(Time at);
  [[nodiscard]] Time end() const { return end_; }

 private:
  using EventKind = Event<CanFrame>::Kind;
  struct Happened {
    EventKind kind;
    Time at;
    CanFrame frame{};
  };

  Event<CanFrame> tell_first();
  void transfer(const Step<CanFrame>& step);
  void push_happened(const Happened& happened);

  Time latency_{};
  Time send_slack_{};
  Time end_ = never;

  std::deque<Happened> happened_;
  CanFrame told_frame_{};
  Waiting<CanFrame> waiting_;
};

}  // namespace absenc::os
