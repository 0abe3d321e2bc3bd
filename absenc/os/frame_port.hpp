// SPDX-License-Identifier: Apache-2.0
// Steps and events (link/step.hpp) on any port that carries CAN frames.
#pragma once

#include <deque>

#include "absenc/link/port.hpp"
#include "absenc/os/waiting.hpp"

namespace absenc::os {

/// Base class of the CAN ports in this folder. `now`, `begin` and `wait` throw Failure, Interrupted or Ended. `sent`
/// has the time before the last frame was handed over.
class FramePort : public Port<CanFrame> {
 public:
  FramePort() = default;
  FramePort(const FramePort&) = delete;
  FramePort& operator=(const FramePort&) = delete;
  virtual ~FramePort() = default;

  [[nodiscard]] Time now() final;
  void begin(const Step<CanFrame>& step) final;
  [[nodiscard]] Event<CanFrame> wait(const Step<CanFrame>& step) final;

  /// Returns the delay between bus and program, which is added to the answer and gap limits.
  [[nodiscard]] Time latency() const { return latency_; }
  void set_latency(Time latency) { latency_ = latency; }

  /// Sets the slack: a transfer due within `slack` is sent at once. Default 0.
  void set_send_slack(Time slack) { send_slack_ = slack; }

  /// Sets the time from which the port throws Ended. Default `never`.
  void set_end(Time end) { end_ = end; }

 protected:
  /// Passes received frames to `push`. Waits for the first one, at most until `deadline`.
  virtual void collect(Time deadline) = 0;
  virtual void send(const CanFrame& frame) = 0;
  virtual void apply(const LineSettings& settings) = 0;

  void push(const CanFrame& frame, Time at);
  /// Queues a `line_error`: a frame was destroyed on the bus or could not be sent.
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
