// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/frame_port.hpp"

#include <algorithm>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

namespace {
// Greatest number of unreported events; at this number a new event displaces the oldest.
constexpr std::size_t most_pending = 4096;
}  // namespace

void FramePort::push(const CanFrame& frame, Time at, Time late) { push_event({EventKind::received, at, late, frame}); }

void FramePort::push_error(Time at, Time late) { push_event({EventKind::line_error, at, late}); }

void FramePort::push_event(const PendingEvent& pending) {
  if (pending_events_.size() == most_pending) pending_events_.pop();
  pending_events_.push(pending);
}

Time FramePort::now() {
  collect(Time{});
  return waiting_.now();
}

void FramePort::begin(const Step<CanFrame>& step) {
  using StepKind = Step<CanFrame>::Kind;
  switch (step.kind) {
    case StepKind::transfer:
      if (interrupted() && take_interrupt()) throw Interrupted{};
      transfer(step);
      break;
    case StepKind::pulse:
      throw Failure(Failure::Kind::unsupported, "a CAN bus has no trigger and clear wires");
    case StepKind::configure:
      apply({.rate = step.rate});
      break;
    case StepKind::wait:
    case StepKind::emit:
    case StepKind::done:
      break;
  }
}

void FramePort::transfer(const Step<CanFrame>& step) {
  if (step.at > os::now() + send_slack_) {
    os::reach(std::min(step.at, end_));
    if (os::now() < step.at) throw Ended{};
  }
  collect(Time{});
  Time at = os::now();
  for (const CanFrame& frame : step.out) {
    at = os::now();
    send(frame);
  }
  push_event({.kind = EventKind::sent, .at = at});
}

Event<CanFrame> FramePort::wait(const Step<CanFrame>& step) {
  waiting_.begin(step, latency_);
  for (;;) {
    if (!pending_events_.empty()) return report_first();
    collect(std::min(waiting_.due(), end_));
    const Time time = os::now();
    if (time >= end_) throw Ended{};
    // Received frames are reported before a silence or a timer event: if this program was late, they may have arrived
    // in time.
    if (!pending_events_.empty()) continue;
    if (const std::optional<Event<CanFrame>> event = waiting_.take_due(time)) return *event;
  }
}

Event<CanFrame> FramePort::report_first() {
  const PendingEvent first = pending_events_.pop();
  if (first.kind == EventKind::sent) {
    waiting_.silence.sent(first.at);
  } else {
    waiting_.silence.received(first.at);
  }
  Event<CanFrame> event{.kind = first.kind, .at = first.at, .late = first.late};
  if (first.kind == EventKind::received) {
    reported_frame_ = first.frame;
    event.items = {&reported_frame_, 1};
  }
  return waiting_.report(event);
}

}  // namespace absenc::os
