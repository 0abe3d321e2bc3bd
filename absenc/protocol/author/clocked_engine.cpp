// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/author/clocked_engine.hpp"

#include <algorithm>

namespace absenc::author {

// ---- Calls of the subclass

void ClockedEngine::clock(unsigned count, bool hold_low) {
  if (count > 8 * storage_.size()) return finish(Error::invalid_argument);
  count_ = count;
  hold_low_ = hold_low;
  state_ = State::ready;
}

void ClockedEngine::finish(Error error) {
  error_ = error;
  state_ = State::over;
}

// ---- Steps

ByteStep ClockedEngine::next(Time now) {
  // The step is made by a lambda, because the compiler would first fill a plain variable with zeros.
  ByteStep step = [this]() -> ByteStep { return {.expect = (count_ + 7) / 8, .bits = count_, .at = never}; }();
  const bool begins = state_ != State::over && !begun_;
  if (begins) {
    begun_ = true;
    rested_at_ = now + times_.rest;  // the pause counts from now, because another host may have clocked just before
  }
  if (state_ == State::over) {
    step.kind = ByteStep::Kind::done;
  } else if (begins && times_.rate != 0) {
    step.kind = ByteStep::Kind::configure;
    step.rate = times_.rate;
  } else if (state_ == State::ready) {
    state_ = State::clocking;
    begun_at_ = std::max(now, rested_at_);
    step.kind = ByteStep::Kind::transfer;
    step.at = rested_at_;
    step.hold_low = hold_low_;
  }
  return step;
}

// ---- Events

void ClockedEngine::feed(const ByteEvent& event) {
  if (state_ != State::clocking) return;
  if (event.kind == ByteEvent::Kind::sent) {
    sent_at_ = event.at;
    // The duration of the transfer is computed with 32 bits, because a processor without division is slow with 64.
    if (times_.rate != 0) begun_at_ = event.at - Time(count_ * (1'000'000'000u / times_.rate));
  }
  if (event.kind != ByteEvent::Kind::received) return;
  received_at_ = event.at;
  rested_at_ = event.at + times_.rest;
  received(event);
}

void ClockedEngine::received(const ByteEvent& event) {
  const std::size_t whole = (count_ + 7) / 8;
  size_ = std::min(event.items.size(), whole);
  std::copy_n(event.items.begin(), size_, storage_.begin());
  if (size_ < whole) return finish(Error::wrong_length);
  // If all bits are 0 and the data line was low before the transfer, too, the line is shorted. Zeros on a line that was
  // idle high are a position.
  if (event.idle_low) {
    std::uint8_t any = 0;
    for (const std::uint8_t byte : storage_.first(size_)) any |= byte;
    if (any == 0) return finish(Error::line_stuck);
  }
  state_ = State::over;  // the conversation ends, unless the virtual function `clocked` begins another transfer
  clocked({Bytes(storage_).first(size_), count_});
}

}  // namespace absenc::author
