// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/listen.hpp"

#include <utility>

#include "absenc/protocol/encolink/fields.hpp"

namespace absenc::encolink {

Listen::Listen(const Format& format, std::uint32_t count) : format_(format), count_(count) {
  if (!format.known()) {
    end(Error::invalid_argument,
        "an encoder that transmits by itself cannot be asked: set resolution and multiturn_bits");
  }
}

void Listen::end(Error error, std::string_view detail) {
  error_ = error;
  detail_ = detail;
  done_ = true;
}

ByteStep Listen::next(Time now) {
  if (std::exchange(emit_pending_, false)) {
    deadline_ = Time{};  // what happens meanwhile is not the encoder's doing
    return {.kind = ByteStep::Kind::emit};
  }
  if (deadline_ == Time{}) deadline_ = now + listen_limit;
  if (!done_ && now >= deadline_) {  // bytes that are no frames may come before every timer
    if (skipped_ == 0 && bytes_.empty()) {
      end(Error::timeout, "nothing comes: the encoder does not transmit by itself, or it was unplugged");
    } else {
      end(last_bad_, last_bad_ == Error::out_of_range
                         ? wrong_resolution
                         : "something comes, but no two frames in a row: check baud, has_ch2 and multiturn_bits");
    }
  }
  if (done_) return {.kind = ByteStep::Kind::done};
  return {.at = deadline_};
}

void Listen::feed(const ByteEvent& event) {
  if (event.kind == ByteEvent::Kind::received) {
    received_at_ = event.at;
    for (const std::uint8_t byte : event.items) byte_received(byte);
  } else if (event.kind == ByteEvent::Kind::line_error) {
    in_step_ = false;
    skipped_ += bytes_.size() + 1;
    bytes_.clear();
  }
}

void Listen::drop(std::size_t count) {
  const auto all = bytes_;
  bytes_.clear();
  bytes_.append(all.view().subspan(count));
}

void Listen::byte_received(std::uint8_t byte) {
  if (done_) return;
  bytes_.push_back(byte);
  const std::size_t size = format_.frame_bytes();
  while (bytes_.size() >= (in_step_ ? size : 2 * size)) {
    const Bytes last = bytes_.view().subspan(in_step_ ? 0 : size, size);
    Result<Position> position = decode_position(format_, bytes_.view().first(size));
    if (position && !in_step_) position = decode_position(format_, last);
    in_step_ = position.has_value();
    if (!position) {
      last_bad_ = position.error();
      ++skipped_;
      drop(1);
      continue;
    }
    position_ = *position;
    frame_.clear();
    frame_.append(last);
    drop(static_cast<std::size_t>(last.data() - bytes_.view().data()) + size);
    reading_ = to_reading(format_, position_);
    reading_.latched = reading_.received = received_at_;  // when it was taken is not known
    done_ = ++found_ == count_;
    emit_pending_ = !done_;
  }
}

void Listen::report(FieldSink& sink) const {
  if (error_ == Error::none && found_ > 0) put_position(sink, format_, position_);
}

}  // namespace absenc::encolink
