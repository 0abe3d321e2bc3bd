// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/author/can_engine.hpp"

namespace absenc::author {

using FrameStep = Step<CanFrame>;
using FrameEvent = Event<CanFrame>;

// ---- Calls of the subclass

void CanEngine::ask(const CanFrame& frame, const CanHostTimes& times, Time pause) {
  ask_for(frame, times.busy_limit);
  silence_ = times.answer_limit;
  until_ = relevant_at_ + pause;
}

void CanEngine::ask_for(const CanFrame& frame, Time duration) {
  request_ = frame;
  has_request_ = true;
  has_relevant_ = false;
  silence_ = until_ = {};
  duration_ = duration;
  listens_ = false;
  state_ = State::ready;
}

void CanEngine::listen(Time duration) {
  silence_ = {};
  duration_ = duration;
  disturbed_ = false;
  listens_ = true;
  state_ = State::beginning;
}

void CanEngine::configure(std::uint32_t rate, Time duration) {
  rate_ = rate;
  duration_ = duration;
  state_ = State::configuring;
}

void CanEngine::finish(const Outcome& outcome) {
  outcome_ = outcome;
  state_ = State::over;
}

void CanEngine::keep(const CanFrame& frame, Time at) {
  relevant_ = frame;
  relevant_at_ = at;
  has_relevant_ = true;
}

void CanEngine::end() {
  state_ = State::over;  // the conversation ends, unless the virtual function `over` continues it
  over();
}

// ---- Events and steps

void CanEngine::feed(const FrameEvent& event) {
  using Kind = FrameEvent::Kind;
  switch (event.kind) {
    case Kind::sent:
      if (state_ != State::sending) break;
      sent_at_ = since_ = event.at;
      if (!has_relevant_) relevant_at_ = event.at;
      until_ = event.at + duration_;
      state_ = State::receiving;
      break;
    case Kind::received:
      for (const CanFrame& frame : event.items) {
        // The receive queue may deliver a frame late that was complete before the request was sent.
        early_ = state_ < State::receiving || event.at < since_;
        if (state_ <= State::receiving && (receives_early_ || !early_)) heard(frame, event.at);
      }
      break;
    case Kind::line_error:
      disturbed_ = true;
      break;
    case Kind::silence:
      if (state_ == State::receiving && silence_ != Time{}) end();
      break;
    default:
      break;
  }
}

FrameStep CanEngine::next(Time now) {
  if (state_ == State::receiving && now >= until_) end();
  FrameStep step{.at = never};
  switch (state_) {
    case State::ready:
      state_ = State::sending;
      disturbed_ = false;
      step.kind = FrameStep::Kind::transfer;
      step.out = {&request_, 1};
      step.expect = 1;
      step.answer = silence_ != Time{} ? silence_ : duration_;
      step.gap = silence_;
      step.at = until_;
      break;
    case State::beginning:
      since_ = now;
      until_ = now + duration_;
      state_ = State::receiving;
      [[fallthrough]];
    case State::sending:
    case State::receiving:
      step.answer = step.gap = silence_;
      if (state_ == State::receiving) step.at = until_;
      step.holds_line = listens_;
      step.expect = listens_ ? 0 : 1;
      break;
    case State::configuring:
      listen(duration_);
      step.kind = FrameStep::Kind::configure;
      step.rate = rate_;
      break;
    case State::over:
      step.kind = FrameStep::Kind::done;
      break;
  }
  return step;
}

}  // namespace absenc::author
