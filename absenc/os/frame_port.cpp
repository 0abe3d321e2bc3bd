// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/frame_port.hpp"

#include <algorithm>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

namespace {
constexpr std::size_t most_kept = 4096;  // limit for received frames that no caller has taken
}

void FramePort::push(const CanFrame& frame, Time at) { push_happened({EventKind::received, at, frame}); }

void FramePort::push_error(Time at) { push_happened({EventKind::line_error, at}); }

void FramePort::push_happened(const Happened& happened) {
  if (happened_.size() == most_kept) happened_.pop_front();
  happened_.push_back(happened);
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
  happened_.push_back({EventKind::sent, at});
}

Event<CanFrame> FramePort::wait(const Step<CanFrame>& step) {
  waiting_.begin(step, latency_);
  for (;;) {
    if (!happened_.empty()) return tell_first();
    collect(std::min(waiting_.due(), end_));
    const Time time = os::now();
    if (time >= end_) throw Ended{};
    // Frames go before limits: a late look by this program is not the fault of the other side.
    if (!happened_.empty()) continue;
    if (const std::optional<Event<CanFrame>> event = waiting_.over(time)) return *event;
  }
}

Event<CanFrame> FramePort::tell_first() {
  const Happened first = happened_.front();
  happened_.pop_front();
  if (first.kind == EventKind::sent) {
    waiting_.silence.sent(first.at);
  } else {
    waiting_.silence.heard(first.at);
  }
  if (first.kind != EventKind::received) return waiting_.tell({.kind = first.kind, .at = first.at});
  told_frame_ = first.frame;
  return waiting_.tell({.kind = EventKind::received, .at = first.at, .items = {&told_frame_, 1}});
}

}  // namespace absenc::os
