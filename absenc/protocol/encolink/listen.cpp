// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/listen.hpp"

#include "absenc/protocol/encolink/fields.hpp"
#include "absenc/protocol/encolink/timing.hpp"

namespace absenc::encolink {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

Listen::Listen(const Format& format, std::uint32_t count) : format_(format), count_(count) {
  if (format.known()) return;
  error_ = Error::invalid_argument;
  detail_ = "an encoder that transmits by itself cannot be asked: set resolution and multiturn_bits";
  done_ = true;
}

ByteStep Listen::next(Time now) {
  if (emit_pending_) {
    emit_pending_ = false;
    deadline_ = Time{};  // what happens meanwhile is not the encoder's doing
    return {.kind = ByteStep::Kind::emit};
  }
  if (deadline_ == Time{}) deadline_ = now + listen_limit;
  if (!done_ && now >= deadline_) give_up();  // bytes that are no frames may come before every timer
  if (done_) return {.kind = ByteStep::Kind::done};
  return {.at = deadline_};
}

void Listen::feed(const ByteEvent& event) {
  if (done_) return;
  if (event.kind == ByteEvent::Kind::received) {
    for (const std::uint8_t byte : event.items) byte_received(byte, event.at);
  } else if (event.kind == ByteEvent::Kind::line_error) {
    in_step_ = false;
    skipped_ += bytes_.size() + 1;
    bytes_.clear();
  }
}

void Listen::byte_received(std::uint8_t byte, Time at) {
  if (done_) return;
  received_at_ = at;
  bytes_.push_back(byte);
  const std::size_t size = format_.frame_bytes();
  const auto drop = [this](std::size_t count) {
    const ByteBuffer<2 * reply_capacity> all = bytes_;
    bytes_.clear();
    bytes_.append(all.view().subspan(count));
  };
  while (bytes_.size() >= size) {
    const Result<Position> first = decode_position(format_, bytes_.view().first(size));
    Result<Position> last = first;
    if (first && !in_step_) {
      if (bytes_.size() < 2 * size) return;
      last = decode_position(format_, bytes_.view().subspan(size, size));
    }
    in_step_ = last.has_value();
    if (last) {
      const bool found_two = bytes_.size() >= 2 * size;
      frame_.clear();
      frame_.append(bytes_.view().subspan(found_two ? size : 0, size));
      drop(found_two ? 2 * size : size);
      accept(*last, at);
    } else {
      last_bad_ = last.error();
      ++skipped_;
      drop(1);
    }
  }
}

void Listen::accept(const Position& position, Time at) {
  position_ = position;
  reading_ = to_reading(format_, position);
  reading_.latched = reading_.received = at;  // when it was taken is not known
  ++found_;
  done_ = found_ == count_;
  emit_pending_ = !done_;
}

void Listen::give_up() {
  done_ = true;
  if (skipped_ == 0 && bytes_.empty()) {
    error_ = Error::timeout;
    detail_ = "nothing comes: the encoder does not transmit by itself, or it was unplugged";
  } else {
    error_ = last_bad_ == Error::none ? Error::wrong_length : last_bad_;
    detail_ = error_ == Error::out_of_range ? wrong_resolution
                                            : "something comes, but no two frames in a row: check baud, has_ch2 and "
                                              "multiturn_bits";
  }
}

const Reading* Listen::reading() const { return error_ == Error::none && found_ > 0 ? &reading_ : nullptr; }

void Listen::report(FieldSink& sink) const {
  if (error_ == Error::none && found_ > 0) put_position(sink, format_, position_);
}

Exchange<std::uint8_t> Listen::exchange() const {
  return {{}, frame_.empty() ? bytes_.view() : frame_.view(), received_at_, received_at_};
}

}  // namespace absenc::encolink
