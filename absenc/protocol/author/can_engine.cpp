// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/author/can_engine.hpp"

#include <algorithm>

namespace absenc::author {

using FrameStep = Step<CanFrame>;
using FrameEvent = Event<CanFrame>;

// ---- For the subclass

void CanEngine::ask(const CanFrame& frame, Time pause) {
  request_ = frame;
  has_request_ = true;
  has_relevant_ = false;
  exact_ = false;
  duration_ = wire_.busy_limit;
  pause_ = pause;
  state_ = State::ready;
}

void CanEngine::ask_for(const CanFrame& frame, Time duration) {
  ask(frame);
  exact_ = true;
  duration_ = duration;
}

void CanEngine::listen(Time duration) {
  exact_ = true;
  duration_ = duration;
  disturbed_ = false;
  since_ = now_;
  until_ = now_ + duration;
  state_ = State::hearing;
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
  state_ = State::over;  // unless the subclass goes on
  over();
}

// ---- Events and steps

void CanEngine::feed(const FrameEvent& event) {
  using Kind = FrameEvent::Kind;
  now_ = std::max(now_, event.at);
  switch (event.kind) {
    case Kind::sent:
      if (state_ != State::sending) break;
      sent_at_ = since_ = event.at;
      if (!has_relevant_) relevant_at_ = event.at;
      until_ = event.at + duration_;
      state_ = State::hearing;
      break;
    case Kind::received:
      // A frame that was complete before the request cannot answer it: it may have waited in a queue for long.
      if (state_ != State::hearing || event.at < since_) break;
      for (const CanFrame& frame : event.items) {
        if (state_ == State::hearing) heard(frame, event.at);
      }
      break;
    case Kind::line_error:
      disturbed_ = true;
      break;
    case Kind::silence:
      if (state_ == State::hearing && !exact_) end();
      break;
    default:
      break;
  }
}

FrameStep CanEngine::next(Time now) {
  now_ = std::max(now_, now);
  if (!started_) {
    started_ = true;
    if (state_ == State::hearing) listen(duration_);  // from now on
  }
  if (state_ == State::hearing && now >= until_) end();
  FrameStep step{.at = never};
  if (!exact_) step.answer = step.gap = wire_.answer_limit;
  switch (state_) {
    case State::ready:
      state_ = State::sending;
      disturbed_ = false;
      step.kind = FrameStep::Kind::transfer;
      step.out = {&request_, 1};
      step.expect = 1;
      step.answer = exact_ ? duration_ : wire_.answer_limit;
      step.at = pause_ > Time{} ? now_ + pause_ : Time{};
      break;
    case State::sending:
      break;
    case State::hearing:
      step.at = until_;
      break;
    case State::configuring:
      listen(duration_);
      step.kind = FrameStep::Kind::configure;
      step.settings = {.rate = rate_};
      break;
    case State::over:
      step.kind = FrameStep::Kind::done;
      break;
  }
  return step;
}

}  // namespace absenc::author
