// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/biss/host.hpp"

#include "absenc/protocol/biss/fields.hpp"

namespace absenc::biss {

namespace {
using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;
}  // namespace

ReadPosition::ReadPosition(const Format& format, const Clocking& clocking)
    : format_(format),
      clocking_(clocking),
      bits_(clocks(format, clocking.latency, LineSettings{.rate = clocking.rate}.bits(1))) {
  if (bits_ > capacity * 8) finish(Error::invalid_argument);
}

ByteStep ReadPosition::next(Time now) {
  switch (state_) {
    case State::configure:
      state_ = State::ready;
      earliest_ = now + timeout_maximum;  // whoever clocked before: the encoder is ready then
      return {.kind = ByteStep::Kind::configure, .settings = {.rate = clocking_.rate}};
    case State::ready:
      state_ = State::clocking;
      return {.kind = ByteStep::Kind::transfer, .expect = (bits_ + 7) / 8, .bits = bits_, .at = earliest_};
    case State::clocking:
      return {.expect = (bits_ + 7) / 8, .bits = bits_, .at = never};
    case State::done:
      break;
  }
  return {.kind = ByteStep::Kind::done};
}

void ReadPosition::feed(const ByteEvent& event) {
  if (state_ != State::clocking) return;
  if (event.kind == ByteEvent::Kind::sent) sent_at_ = event.at;
  if (event.kind != ByteEvent::Kind::received) return;
  received_at_ = event.at;
  received(event.items);
}

void ReadPosition::received(Bytes bytes) {
  samples_.clear();
  if (!samples_.append(bytes) || samples_.size() * 8 < bits_) return finish(Error::wrong_length);
  const Result<Reply> reply = decode(format_, {samples_.view(), bits_});
  if (!reply) return finish(reply.error());
  const Reply before = reply_;
  reply_ = *reply;
  if (format_.check == Check::crc16 && !second_) {
    second_ = true;
    earliest_ = received_at_ + timeout_maximum;
    state_ = State::ready;
    return;
  }
  const unsigned expected = (before.life_counter + 1u) & low_mask(life_counter_bits);
  if (second_ && reply_.life_counter != expected) return finish(Error::sequence_mismatch);
  reading_ = to_reading(format_.word, reply_.word, format_.scale);
  reading_.latched = sent_at_ - LineSettings{.rate = clocking_.rate}.bits(bits_);  // the first falling edge of MA
  reading_.received = received_at_;
  finish(Error::none);
}

void ReadPosition::finish(Error error) {
  error_ = error;
  state_ = State::done;
}

std::string_view ReadPosition::detail() const {
  switch (error_) {
    case Error::invalid_argument:
      return "a frame of more than 512 clocks: lower latency_us or ma_khz";
    case Error::truncated:
      return "ACK and line take longer than latency_us allows at this clock: raise it, or lower the MA clock";
    case Error::bad_checksum:
      return "the delay of the line may not suit this MA clock: try another one";
    default:
      return {};
  }
}

const Reading* ReadPosition::reading() const {
  return state_ == State::done && error_ == Error::none ? &reading_ : nullptr;
}

void ReadPosition::report(FieldSink& sink) const {
  if (reading() != nullptr) put_fields(sink, format_, reply_);
}

Exchange<std::uint8_t> ReadPosition::exchange() const { return {{}, samples_, sent_at_, received_at_}; }

}  // namespace absenc::biss
