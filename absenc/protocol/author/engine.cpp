// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/author/engine.hpp"

#include <algorithm>
#include <utility>

namespace absenc::author {

// ---- Calls of the subclass

void Engine::send(Bytes request, const Manner& manner, Time earliest) {
  out_ = request;
  manner_ = manner;
  if (manner.answer_limit == Time{}) manner_.answer_limit = times_.answer_limit;
  start(earliest);
}

void Engine::start(Time earliest) {
  item_received_ = noisy_ = false;
  earliest_ = earliest;
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

void Engine::finish(Error error, Time hold) {
  error_ = error;
  earliest_ = received_at_ + hold;
  state_ = hold == Time{} ? State::over : State::ending;
}

// ---- Steps

ByteStep Engine::next(Time now) {
  // The step is made by a lambda, because the compiler would first fill a plain variable with zeros.
  ByteStep step = [this]() -> ByteStep {
    return {.expect = due_, .at = never, .answer = manner_.answer_limit, .gap = times_.gap_limit};
  }();
  // In the middle of a reply this function returns early, because there is little time between two characters.
  if (state_ == State::receiving) return step;
  step.expect = 0;
  // The traffic before this conversation is unknown, so pauses are measured from now.
  if (!started_) received_at_ = now;
  started_ = true;
  wake(now);
  if (rate_ != 0) {
    step.kind = ByteStep::Kind::configure;
    step.rate = std::exchange(rate_, 0);
  } else if (std::exchange(emitting_, false)) {
    step.kind = ByteStep::Kind::emit;
  } else if (const Time rest = rest_end(); now < rest) {
    step.at = rest;
    step.answer = step.gap = {};
    step.holds_line = state_ == State::listening;
  } else {
    begin_or_end(step, now);
  }
  return step;
}

// Ends sleeps and listening times that are over. The loop is needed because `woken` may begin a sleep whose end has
// already passed.
void Engine::wake(Time now) {
  while ((state_ == State::sleeping || state_ == State::listening) && rate_ == 0 && !emitting_) {
    if (state_ == State::listening && earliest_ == never) earliest_ = now + listening_;
    if (now < earliest_) return;
    if (state_ == State::listening) received_at_ = earliest_;
    state_ = State::over;  // the conversation ends, unless the virtual function `woken` continues it
    woken();
  }
}

// Returns the time until which the host must wait. A request that needs no silent line is returned at once: its step
// says when to send it.
Time Engine::rest_end() const {
  if (state_ == State::ready && times_.silence != Time{}) return std::max(received_at_ + times_.silence, earliest_);
  return state_ >= State::sleeping && state_ != State::over ? earliest_ : Time::min();
}

void Engine::begin_or_end(ByteStep& step, Time now) {
  if (state_ == State::ready) {
    state_ = State::sending;
    disturbed_ = item_received_ = noisy_ = false;
    size_ = 0;
    step.at = begun_at_ = std::max({now, earliest_, received_at_ + times_.pause});
    step.kind = manner_.pulse != Time{} ? ByteStep::Kind::pulse : ByteStep::Kind::transfer;
    step.width = manner_.frame != 0 ? manner_.frame_pause : manner_.pulse;
    step.frame = manner_.frame;
    step.wire = manner_.wire;
    step.holds_line = manner_.holds_line;
    step.out = out_;
    if (manner_.expects_reply) step.expect = expected();
  } else if (state_ >= State::ending) {
    state_ = State::over;
    step.kind = ByteStep::Kind::done;
  }
}

// ---- Events

void Engine::feed(const ByteEvent& event) {
  using Kind = ByteEvent::Kind;
  const bool damaged = event.kind == Kind::line_error;
  if (!damaged && event.kind != Kind::received) {
    if (event.kind == Kind::sent) sent(event.at);
    if (event.kind == Kind::silence && is_awaited()) conclude();
    return;
  }
  const State before = state_;
  if (before >= State::ending) return;
  if (damaged) {
    if (before == State::receiving) state_ = State::settling;
    if (before != State::listening) disturbed_ = true;
  } else {
    received_at_ = event.at;
    keep(event.items);
  }
  if (!is_awaited() && handle_unawaited(event)) return;
  if (!item_received_) {
    item_received_ = true;
    noise_end_ = event.at + times_.patience;
  }
  noisy_ = event.at >= noise_end_;
  check_reply();
  if (noisy_) end_noise(before);
}

// Handles an event that arrives while no reply is awaited. Returns true if the event needs no further handling.
bool Engine::handle_unawaited(const ByteEvent& event) {
  const bool damaged = event.kind == ByteEvent::Kind::line_error;
  if (state_ == State::listening) {
    heard(damaged ? Bytes{} : event.items);
    return true;
  }
  // A reply may arrive while the pulse is still active, because an encoder may answer the pulse's first edge.
  const bool pulsing = state_ == State::sending && manner_.pulse != Time{};
  if (!pulsing) disturbed_ = true;
  return false;
}

void Engine::end_noise(State before) {
  if (is_awaited() || (before == State::ready && state_ == State::ready)) {
    conclude();
  } else if (state_ != State::sending) {
    item_received_ = noisy_ = false;  // no exchange awaits a reply now, so this noise does not matter
  }
}

void Engine::sent(Time at) {
  sent_at_ = at - manner_.pulse;
  received_at_ = at;
  if (state_ != State::sending) return;
  if (!manner_.expects_reply) return conclude_with(Error::none);
  state_ = disturbed_ ? State::settling : State::receiving;
  check_reply();  // bytes may have been received during a pulse
}

// After an error more bytes may follow, and sending into them can destroy the encoder's driver.
void Engine::check_reply() {
  if (state_ != State::receiving) return;
  const std::size_t whole = expected();
  due_ = whole > size_ ? whole - size_ : 0;
  if (whole == 0 || due_ != 0 || manner_.ends_by_silence || manner_.any_reply) return;
  const Error error = check();
  if (error == Error::none || is_whole(error)) return conclude_with(error);
  state_ = State::settling;
}

void Engine::conclude() {
  if (size_ == 0) {
    if (disturbed_) return conclude_with(Error::bad_framing);
    return conclude_with(manner_.any_reply ? Error::none : Error::timeout);
  }
  // On a disturbed or noisy line the received bytes may include others than those of the reply.
  if (disturbed_ || noisy_) return conclude_with(Error::wrong_length);
  conclude_with(manner_.any_reply ? Error::none : check());
}

void Engine::conclude_with(Error error) {
  if (error != Error::none && manner_.repeats > 0 && !noisy_) {
    --manner_.repeats;
    return start(received_at_ + manner_.pause);
  }
  state_ = State::over;  // the conversation ends, unless the virtual function `concluded` continues it
  concluded(error);
}

}  // namespace absenc::author
