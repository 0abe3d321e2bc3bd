// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/author/bit_engine.hpp"

#include <algorithm>
#include <utility>

namespace absenc::author {

// ---- Calls of the subclass

void BitEngine::send(const BitRequest& request, const Manner& manner, Time earliest) {
  earliest_ = std::max(earliest, received_at_ + request_.hold);
  request_ = request;
  manner_ = manner;
  state_ = State::ready;
  if (request.clocks > 8 * storage_.size()) finish(Error::invalid_argument);
}

void BitEngine::sleep(Time time) {
  earliest_ = time;
  state_ = State::sleeping;
}

void BitEngine::finish(Error error, Time hold) {
  error_ = error;
  hold = std::max(hold, request_.hold);
  earliest_ = received_at_ + hold;
  state_ = hold == Time{} ? State::over : State::ending;
}

// ---- Steps

ByteStep BitEngine::next(Time now) {
  // The step is made by a lambda, because the compiler would first fill a plain variable with zeros.
  ByteStep step = []() -> ByteStep { return {.at = never}; }();
  // The traffic before this conversation is unknown, so pauses are measured from now.
  if (!started_) received_at_ = now;
  started_ = true;
  while (state_ == State::sleeping && !emitting_ && now >= earliest_) {
    state_ = State::over;  // the conversation ends, unless `woken` continues it
    woken();
  }
  if (std::exchange(emitting_, false)) {
    step.kind = ByteStep::Kind::emit;
  } else if (state_ == State::sleeping || (state_ == State::ending && now < earliest_)) {
    step.at = earliest_;
  } else if (state_ == State::ending || state_ == State::over) {
    state_ = State::over;
    step.kind = ByteStep::Kind::done;
  } else if (state_ == State::clocking || state_ == State::added) {
    step.expect = (awaited_ + 7) / 8;
  } else {
    begin_transfer(step, now);
  }
  return step;
}

void BitEngine::begin_transfer(ByteStep& step, Time now) {
  step.kind = ByteStep::Kind::transfer;
  step.holds_line = manner_.holds_line;
  step.rate = request_.rate;
  step.at = now;
  out_.clear();
  if (state_ == State::ready) {
    size_ = 0;
    reply_error_ = Error::none;
    out_ = sent_bits_ = request_.bits;
    awaited_ = request_.clocks;
    step.at = begun_at_ = std::max({now, earliest_, received_at_ + request_.rest});
    step.goes_on = goes_on();
    state_ = State::clocking;
  } else if (state_ == State::missing) {
    awaited_ = missing();
    step.goes_on = true;
    state_ = State::clocking;
  } else if (reply_error_ == Error::none) {
    out_ = request_.supplement;
    static_cast<void>(
        sent_bits_.append(out_.view().load(0, static_cast<unsigned>(out_.size())), static_cast<unsigned>(out_.size())));
    awaited_ = 0;
    state_ = State::added;
  } else {
    awaited_ = 1;  // after an invalid reply one clock follows instead of the supplement
    state_ = State::added;
  }
  if (step.goes_on && request_.rate != 0) {
    const std::size_t rest = request_.late_clocks + request_.supplement.size();
    step.width = Time(1'000'000'000u / request_.rate) * static_cast<std::int64_t>(rest);
  }
  step.out = out_.bytes();
  step.out_bits = out_.size();
  step.bits = out_.size() + awaited_;
  step.expect = (awaited_ + 7) / 8;
}

// ---- Events

void BitEngine::feed(const ByteEvent& event) {
  using Kind = ByteEvent::Kind;
  if (event.kind == Kind::sent && (state_ == State::clocking || state_ == State::added)) {
    received_at_ = event.at;
    if (size_ == 0 && awaited_ != 0) {
      // The period is computed with 32 bits, because a processor without division is slow with 64.
      const auto period = Time(request_.rate != 0 ? 1'000'000'000u / request_.rate : 0u);
      begun_at_ = event.at - period * static_cast<std::int64_t>(out_.size() + awaited_);
      sent_at_ = event.at - period * static_cast<std::int64_t>(awaited_);
    }
    if (state_ == State::added && awaited_ == 0) conclude_with(Error::none);
    return;
  }
  if (event.kind == Kind::received && (state_ == State::clocking || state_ == State::added)) received(event);
}

void BitEngine::received(const ByteEvent& event) {
  received_at_ = event.at;
  sampled_after_ = event.width;
  if (state_ == State::added) return conclude_with(reply_error_);
  append({event.items, std::min({event.bits, 8 * event.items.size(), awaited_})});
  const bool whole = event.bits >= awaited_;
  if (goes_on() && whole && missing() != 0 && size_ + missing() <= 8 * storage_.size()) {
    state_ = State::missing;
    return;
  }
  reply_error_ = whole ? check() : Error::wrong_length;
  if (goes_on()) {
    state_ = State::adding;
  } else {
    conclude_with(reply_error_);
  }
}

void BitEngine::append(BitView bits) {
  for (std::size_t i = 0; i < bits.size && size_ < 8 * storage_.size(); ++i, ++size_) {
    const auto mask = static_cast<std::uint8_t>(0x80u >> size_ % 8);
    std::uint8_t& byte = storage_[size_ / 8];
    if (size_ % 8 == 0) byte = 0;
    if (bits[i]) byte = static_cast<std::uint8_t>(byte | mask);
  }
}

void BitEngine::conclude_with(Error error) {
  if (error != Error::none && manner_.repeats > 0) {
    --manner_.repeats;
    earliest_ = received_at_ + manner_.pause;
    state_ = State::ready;
    return;
  }
  state_ = State::over;  // the conversation ends, unless `concluded` continues it
  concluded(error);
}

}  // namespace absenc::author
