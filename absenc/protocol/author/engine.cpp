// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/author/engine.hpp"

#include <algorithm>
#include <utility>

namespace absenc::author {

// ---- For the subclass

void Engine::send(Bytes request, const Manner& manner, Time earliest) {
  out_ = request;
  manner_ = manner;
  attempts_left_ = manner.attempts;
  start(earliest);
}

void Engine::start(Time earliest) {
  noise_.clear();  // it counts anew
  earliest_ = earliest;
  --attempts_left_;
  state_ = State::ready;
}

void Engine::sleep(Time time) {
  earliest_ = time;
  state_ = State::sleeping;
}

void Engine::listen(Time duration) {
  listening_ = duration;
  earliest_ = never;
  out_ = {};
  size_ = 0;
  state_ = State::listening;
}

void Engine::finish(const Outcome& outcome) {
  outcome_ = outcome;
  earliest_ = received_at_ + outcome.hold;
  state_ = outcome.hold == Time{} ? State::over : State::ending;
}

// ---- Steps

ByteStep Engine::next(Time now) {
  if (state_ == State::receiving) return waiting_step();  // at once: between two characters there is little time
  // What was on the line before this conversation is not known.
  if (!begun_) received_at_ = now;
  begun_ = true;
  wake(now);
  if (rate_ != 0) return {.kind = ByteStep::Kind::configure, .rate = std::exchange(rate_, 0)};
  if (std::exchange(emitting_, false)) return {.kind = ByteStep::Kind::emit};
  if (const Time rest = rest_end(); now < rest) return {.at = rest};
  return exchange_step(now);
}

// The subclass may rest again. What it has told before comes first.
void Engine::wake(Time now) {
  while ((state_ == State::sleeping || state_ == State::listening) && rate_ == 0 && !emitting_) {
    if (state_ == State::listening && earliest_ == never) earliest_ = now + listening_;
    if (now < earliest_) return;
    if (state_ == State::listening) received_at_ = earliest_;
    state_ = State::over;  // unless the subclass goes on
    woken();
  }
}

// Before it nothing is done.
Time Engine::rest_end() const {
  switch (state_) {
    case State::sleeping:
    case State::listening:
    case State::ending:
      return earliest_;
    case State::ready:
      if (times_.silence != Time{}) return std::max(received_at_ + times_.silence, earliest_);
      [[fallthrough]];
    default:
      return Time::min();
  }
}

ByteStep Engine::waiting_step() const {
  return {.expect = due_,
          .at = never,
          .answer = manner_.answer_limit != Time{} ? manner_.answer_limit : times_.answer_limit,
          .gap = times_.gap_limit};
}

// Apart, so that the step is made where the caller has it: from a function that returns several it would be copied.
ByteStep Engine::exchange_step(Time now) {
  ByteStep step = waiting_step();
  step.expect = 0;
  if (state_ == State::ready) {
    state_ = State::sending;
    disturbed_ = false;
    noise_.clear();
    size_ = 0;
    begun_at_ = std::max(now, earliest_);
    step.kind = manner_.pulse != Time{} ? ByteStep::Kind::pulse : ByteStep::Kind::transfer;
    step.width = manner_.pulse;
    step.wire = manner_.wire;
    step.out = out_;
    step.expect = manner_.expects_reply ? expected({}) : 0;
    step.at = times_.silence != Time{} ? begun_at_ : std::max(earliest_, Time{});
  } else if (state_ == State::ending || state_ == State::over) {
    state_ = State::over;
    step.kind = ByteStep::Kind::done;
  }
  return step;
}

// ---- Events

void Engine::feed(const ByteEvent& event) {
  using Kind = ByteEvent::Kind;
  switch (event.kind) {
    case Kind::sent:
      sent(event.at);
      break;
    case Kind::received: {
      if (state_ == State::ending || state_ == State::over) break;
      received_at_ = event.at;
      if (state_ == State::listening) {
        keep(event.items);
        return heard(event.items);
      }
      const State before = state_;
      const bool pulsing = before == State::sending && manner_.pulse != Time{};  // its edge is past already
      if (before != State::receiving && before != State::settling && !pulsing) disturbed_ = true;
      noise_.heard(event.at);
      received(event.items);
      end_noise(before);
      break;
    }
    case Kind::line_error:
      if (state_ == State::listening) return heard({});
      disturbed_ = true;
      noise_.heard(event.at);
      if (state_ == State::receiving) state_ = State::settling;
      end_noise(state_);
      break;
    case Kind::silence:
      if (state_ == State::receiving || state_ == State::settling) conclude();
      break;
    default:
      break;
  }
}

void Engine::sent(Time at) {
  sent_at_ = at - manner_.pulse;
  received_at_ = at;
  if (state_ != State::sending) return;
  if (!manner_.expects_reply) return conclude_with(Error::none);
  state_ = disturbed_ ? State::settling : State::receiving;
  received({});  // what came during a pulse
}

// What no longer fits changes nothing: it is too long already.
void Engine::keep(Bytes bytes) {
  const MutableBytes room = storage_.subspan(size_);
  const std::size_t fitting = std::min(bytes.size(), room.size());
  for (std::size_t i = 0; i < fitting; ++i) room[i] = bytes[i];
  size_ += fitting;
}

void Engine::received(Bytes bytes) {
  keep(bytes);
  if (state_ != State::receiving) return;
  const std::size_t whole = expected(reply());
  due_ = whole > size_ ? whole - size_ : 0;
  if (whole == 0 || due_ != 0 || manner_.ends_by_silence || manner_.any_reply) return;
  const Error error = check(reply());
  if (error == Error::none || is_whole(error)) return conclude_with(error);
  state_ = State::settling;
}

void Engine::conclude() {
  if (disturbed_ && size_ == 0) return conclude_with(Error::bad_framing);
  // Bytes that are not this reply's.
  if (size_ != 0 && (disturbed_ || is_noisy())) return conclude_with(Error::wrong_length);
  conclude_with(manner_.any_reply ? Error::none : check(reply()));
}

void Engine::conclude_with(Error error) {
  if (error != Error::none && attempts_left_ > 0 && !is_noisy()) {
    return start(manner_.pause == Time{} ? Time{} : received_at_ + manner_.pause);
  }
  state_ = State::over;  // unless the subclass goes on
  concluded(error);
}

void Engine::end_noise(State before) {
  const bool waits = state_ == State::receiving || state_ == State::settling;
  const bool listens = state_ == State::ready && before == State::ready;
  if (!waits && !listens && state_ != State::sending) return noise_.clear();  // the reply was taken
  if (is_noisy() && state_ != State::sending) conclude();
}

}  // namespace absenc::author
