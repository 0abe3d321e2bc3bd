// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/ssi/host.hpp"

namespace absenc::ssi {

namespace {
using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;
}  // namespace

ReadPosition::ReadPosition(const Format& format, Time pause) : format_(format), pause_(pause) {
  if (clocks(format) > frame_capacity) finish(Error::invalid_argument);
}

ByteStep ReadPosition::next(Time now) {
  ByteStep step{.expect = (clocks(format_) + 7) / 8, .bits = clocks(format_), .at = never};
  switch (state_) {
    case State::ready:
      state_ = State::clocking;
      clocked_at_ = now + pause_ + pause_margin;  // whoever clocked before: the encoder takes a new position then
      step.kind = ByteStep::Kind::transfer;
      step.at = clocked_at_;
      break;
    case State::clocking:
      break;
    case State::done:
      step.kind = ByteStep::Kind::done;
      break;
  }
  return step;
}

void ReadPosition::feed(const ByteEvent& event) {
  if (state_ != State::clocking) return;
  if (event.kind == ByteEvent::Kind::sent) sent_at_ = event.at;
  if (event.kind != ByteEvent::Kind::received) return;
  received_at_ = event.at;
  received(event.items);
}

void ReadPosition::received(Bytes bytes) {
  const unsigned count = clocks(format_);
  if (!bits_.append(bytes) || bits_.size() * 8 < count) return finish(Error::wrong_length);
  const Result<Word> word = decode(format_, {bits_.view(), count});
  if (!word) return finish(word.error());
  word_ = *word;
  reading_ = to_reading(format_.word, word_, format_.scale);
  reading_.latched = clocked_at_;  // the first falling edge; a real port may be later
  reading_.received = received_at_;
  finish(Error::none);
}

void ReadPosition::finish(Error error) {
  error_ = error;
  state_ = State::done;
}

std::string_view ReadPosition::detail() const {
  if (error_ == Error::cross_check_failed) {
    return "the bits behind the word are not what after_word says: the number of bits may be wrong, or the line noisy";
  }
  if (error_ == Error::bad_checksum) return "the parity of the word is wrong";
  return {};
}

const Reading* ReadPosition::reading() const {
  return state_ == State::done && error_ == Error::none ? &reading_ : nullptr;
}

void ReadPosition::report(FieldSink& sink) const {
  if (reading() != nullptr) put_word(sink, format_.word, word_, format_.scale);
}

Exchange<std::uint8_t> ReadPosition::exchange() const { return {{}, bits_, sent_at_, received_at_}; }

}  // namespace absenc::ssi
