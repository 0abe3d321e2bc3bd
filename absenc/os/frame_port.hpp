// SPDX-License-Identifier: Apache-2.0
// Steps and events (link/step.hpp) on any port that carries CAN frames.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "absenc/link/port.hpp"
#include "absenc/os/waiting.hpp"

namespace absenc::os {

/// Base class of the CAN ports in this folder. `now`, `begin` and `wait` throw Failure, Interrupted or Ended. The
/// event `sent` has the time before the last frame was handed to the kernel or adapter.
class FramePort : public Port<CanFrame> {
 public:
  FramePort() = default;
  FramePort(const FramePort&) = delete;
  FramePort& operator=(const FramePort&) = delete;
  virtual ~FramePort() = default;

  [[nodiscard]] Time now() final;
  void begin(const Step<CanFrame>& step) final;
  [[nodiscard]] Event<CanFrame> wait(const Step<CanFrame>& step) final;

  /// Returns the delay between bus and program, which is added to the limits Step::answer and Step::gap.
  [[nodiscard]] Time latency() const { return latency_; }
  void set_latency(Time latency) { latency_ = latency; }

  /// Sets the send slack: a transfer whose time is at most `slack` ahead is sent at once. Default 0.
  void set_send_slack(Time slack) { send_slack_ = slack; }

  /// Sets the time at which a wait of the port ends with Ended. Default `never`.
  void set_end(Time end) { end_ = end; }

 protected:
  /// Passes received frames to `push`. Waits for the first one, at most until `deadline`.
  virtual void collect(Time deadline) = 0;
  virtual void send(const CanFrame& frame) = 0;
  virtual void apply(const LineSettings& settings) = 0;

  /// Queues a received frame with the time `at`; the frame may have arrived earlier by up to `late`, 0: by an unknown
  /// time.
  void push(const CanFrame& frame, Time at, Time late = {});
  /// Queues a `line_error`: a frame was destroyed on the bus or could not be sent.
  void push_error(Time at, Time late = {});
  [[nodiscard]] Time end() const { return end_; }

 private:
  using EventKind = Event<CanFrame>::Kind;
  struct PendingEvent {
    EventKind kind;
    Time at;
    Time late{};
    CanFrame frame{};
  };

  /// A queue that keeps its memory, so that a port in use seldom allocates any.
  class Queue {
   public:
    Queue() { events_.reserve(usual); }
    [[nodiscard]] bool empty() const { return first_ == events_.size(); }
    [[nodiscard]] std::size_t size() const { return events_.size() - first_; }
    void push(const PendingEvent& event) {
      if (events_.size() == events_.capacity() && first_ >= events_.size() / 2) {
        events_.erase(events_.begin(), events_.begin() + static_cast<std::ptrdiff_t>(std::exchange(first_, 0)));
      }
      events_.push_back(event);
    }
    PendingEvent pop() {
      const PendingEvent event = events_[first_++];
      if (!empty()) return event;
      events_.clear();
      first_ = 0;
      return event;
    }

   private:
    static constexpr std::size_t usual = 512;  // number of events for which memory is reserved at first

    std::vector<PendingEvent> events_;
    std::size_t first_ = 0;  // index of the oldest event in `events_` that was not reported yet
  };

  Event<CanFrame> report_first();
  void transfer(const Step<CanFrame>& step);
  void push_event(const PendingEvent& pending);

  Time latency_{};
  Time send_slack_{};
  Time end_ = never;

  Queue pending_events_;
  CanFrame reported_frame_{};
  Waiting<CanFrame> waiting_;
};

}  // namespace absenc::os
