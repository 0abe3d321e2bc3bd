// SPDX-License-Identifier: Apache-2.0
// Steps and events (link/step.hpp) on any port that carries CAN frames: the common timing of such ports.
#pragma once

#include <deque>

#include "absenc/link/port.hpp"
#include "absenc/os/waiting.hpp"

namespace absenc::os {

/// Base class of the CAN ports in this folder. `now`, `begin` and `wait` throw Failure, Interrupted (os/signals.hpp) or
/// Ended.
///
/// A transfer begins at `at`, earlier only by the send slack; `begin` blocks until then. A frame received before a
/// transfer began, or before `now` was called, is reported with a time not later than that transfer or call, however
/// long the frame waited in a queue. Because replies on CAN carry no number, the machine recognises such an old frame
/// only by its time. `sent` carries the time before the frame was handed to the kernel, because the kernel does not
/// report when the controller has sent it; so a reply is never older than `sent`. `timer` is reported as by StreamPort.
class FramePort : public Port<CanFrame> {
 public:
  FramePort() = default;
  FramePort(const FramePort&) = delete;
  FramePort& operator=(const FramePort&) = delete;
  virtual ~FramePort() = default;

  [[nodiscard]] Time now() final;
  void begin(const Step<CanFrame>& step) final;
  [[nodiscard]] Event<CanFrame> wait(const Step<CanFrame>& step) final;

  /// Returns the delay between the bus and this program, which is added to the answer and gap limits of a step.
  [[nodiscard]] Time latency() const { return latency_; }
  void set_latency(Time latency) { latency_ = latency; }

  /// Sets the slack: a transfer due within `slack` is sent at once. Default 0.
  void set_send_slack(Time slack) { send_slack_ = slack; }

  /// Sets the time from which the port throws Ended. Default `never`.
  void set_end(Time end) { end_ = end; }

 protected:
  /// Passes received frames to `push`. Waits for the first one, at most until `deadline`; does not wait if `deadline`
  /// is in the past.
  virtual void collect(Time deadline) = 0;
  virtual void send(const CanFrame& frame) = 0;
  virtual void apply(const LineSettings& settings) = 0;

  void push(const CanFrame& frame, Time at);
  /// Queues the event `line_error` for `wait`: a frame was destroyed on the bus or could not be sent.
  void push_error(Time at);
  [[nodiscard]] Time end() const { return end_; }

 private:
  using EventKind = Event<CanFrame>::Kind;
  struct PendingEvent {
    EventKind kind;
    Time at;
    CanFrame frame{};
  };

  Event<CanFrame> report_first();
  void transfer(const Step<CanFrame>& step);
  void push_event(const PendingEvent& pending);

  Time latency_{};
  Time send_slack_{};
  Time end_ = never;

  std::deque<PendingEvent> pending_events_;
  CanFrame reported_frame_{};
  Waiting<CanFrame> waiting_;
};

}  // namespace absenc::os
