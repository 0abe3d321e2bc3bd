// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/listen.hpp"

#include <algorithm>
#include <utility>

#include "absenc/protocol/encolink/fields.hpp"

namespace absenc::encolink {

Listen::Listen(const Format& format) : format_(format), discarded_(format.frame_bytes()) {
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
  if (!done_ && find()) {
    // The next call of this function starts the timeout again, so that it does not include the time in which the caller
    // processes the frame.
    deadline_ = Time{};
    return {.kind = ByteStep::Kind::emit};
  }
  if (deadline_ == Time{}) deadline_ = now + listen_limit;
  // Received bytes that form no valid frame do not extend the deadline.
  if (!done_ && now >= deadline_) {
    frame_.clear();
    if (!received_anything_) {
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
  const bool damaged = event.kind == ByteEvent::Kind::line_error;
  if (done_ || (!damaged && event.kind != ByteEvent::Kind::received)) return;
  received_anything_ = true;
  if (damaged) {
    disturbed_ = std::exchange(in_step_, false);
    discarded_.skip(waiting().size() + 1);
    begin_ = end_ = 0;
  } else {
    received_at_ = event.at;
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(begin_), end_ - begin_, bytes_.begin());
    end_ -= std::exchange(begin_, 0);
    const std::size_t fitting = std::min(event.items.size(), bytes_.size() - end_);
    std::copy_n(event.items.begin(), fitting, bytes_.begin() + static_cast<std::ptrdiff_t>(end_));
    end_ += fitting;
    discarded_.skip(event.items.size() - fitting);
  }
  counts_.discarded = discarded_.count();
}

// Finds the next valid frame, or a fault after which the host does not know where frames begin. Returns false if the
// received bytes contain neither.
bool Listen::find() {
  if (std::exchange(disturbed_, false)) {
    lose(Error::bad_framing, {});
    return true;
  }
  const std::size_t size = format_.frame_bytes();
  while (waiting().size() >= (in_step_ ? size : 2 * size)) {
    const Bytes first = waiting().first(size);
    const Result<Position> position = decode_position(format_, first);
    const bool good = position && (in_step_ || decode_position(format_, waiting().subspan(size, size)));
    if (good) {
      // Two valid frames in a row show where frames begin. The first is dropped, because it is unknown when it began.
      if (!std::exchange(in_step_, true)) begin_ += size;
      discarded_.found();
      const Bytes frame = waiting().first(size);
      take(frame, *decode_position(format_, frame));
      begin_ += size;
      return true;
    }
    if (!position) last_bad_ = position.error();
    const bool lost = std::exchange(in_step_, false);
    if (lost) lose(last_bad_, first);
    discarded_.skip(1);
    ++begin_;
    counts_.discarded = discarded_.count();
    if (lost) return true;
  }
  return false;
}

void Listen::take(Bytes frame, const Position& position) {
  error_ = Error::none;
  detail_ = {};
  received_anything_ = false;
  position_ = position;
  frame_.clear();
  frame_.append(frame);
  reading_ = to_reading(format_, position_);
  // Assumed: the encoder takes the position at the begin of the frame, which no document states.
  reading_.latched = received_at_ - uart_settings.character() * static_cast<std::int64_t>(waiting().size());
  reading_.received = received_at_;
}

void Listen::lose(Error error, Bytes frame) {
  error_ = error;
  detail_ = "a frame of the stream is damaged";
  frame_.clear();
  frame_.append(frame);
}

void Listen::report(FieldSink& sink) const {
  if (reading() != nullptr) put_position(sink, format_, position_);
}

}  // namespace absenc::encolink
