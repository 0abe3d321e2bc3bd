// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/serial/listen.hpp"

#include <algorithm>

#include "absenc/protocol/raa38/serial/explain.hpp"
#include "absenc/protocol/raa38/serial/fields.hpp"
#include "absenc/protocol/raa38/serial/timing.hpp"

namespace absenc::raa38::serial {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

Listen::Listen(const Format& format) : format_(format), decoder_(format) {
  if (format.maximum_rpm == 0 || format.period() > Time{}) return;
  fail(Error::invalid_argument, {"max_rpm needs to know how often the encoder transmits", "set refresh_hz as well"});
  done_ = true;
}

ByteStep Listen::next(Time now) {
  if (taken_ < waiting_.size()) {
    take(waiting_[taken_++]);
    arm_ = true;
    return {.kind = ByteStep::Kind::emit};
  }
  // Whoever stops at a result and comes back later has not waited in vain meanwhile.
  if (arm_) deadline_ = now + std::max(listen_limit, 4 * format_.period());
  arm_ = false;
  if (!done_ && now >= deadline_) give_up();  // bytes that are no frames may come before every timer
  if (done_) return {.kind = ByteStep::Kind::done};
  return {.at = deadline_};
}

void Listen::feed(const ByteEvent& event) {
  if (done_) return;
  const auto keep = [this](const Found& found) { waiting_.push_back(found); };
  if (taken_ == waiting_.size()) {
    waiting_.clear();
    taken_ = 0;
  }
  if (event.kind == ByteEvent::Kind::received) {
    heard_before_ = good_ == 0 && !heard_ ? event.at : heard_at_;
    heard_at_ = event.at;
    heard_ = true;
    decoder_.feed(event.items, event.at, keep);
  } else if (event.kind == ByteEvent::Kind::line_error) {
    heard_ = true;
    decoder_.disturbed(keep);
  }
}

void Listen::take(const Found& found) {
  error_ = Error::none;
  words_ = {};
  frame_.clear();
  if (found.error != Error::none) {
    frame_.append(decoder_.bad());
    return fail(found.error, {"a frame of the stream is damaged", {}});
  }
  ++frame_number_;
  frame_ = encode_position(format_, {found.singleturn, format_.own_second_byte()});
  const Time latched = std::max(latched_time(found), reading_.latched);
  if (is_plausible(found.singleturn, latched)) return accept(found, latched);
  fail(Error::cross_check_failed,
       {"the position jumped farther than max_rpm allows",
        "the checksum does not see swapped bytes: read again, and check shielding, bits and max_rpm"});
}

void Listen::accept(const Found& found, Time latched) {
  reading_ = to_reading(format_, {found.singleturn, format_.own_second_byte()}, latched, found.at);
  last_good_at_ = latched;
  last_good_ = found.singleturn;
  last_number_ = frame_number_;
  has_suspect_ = false;
  heard_ = false;
  ++good_;
}

// A position is compared with the last good one, or with the last that was refused: when two of these agree, the
// first one was wrong, or the shaft was turned while nobody could see it.
bool Listen::is_plausible(std::uint32_t singleturn, Time latched) {
  if (format_.maximum_rpm == 0 || good_ == 0) return true;
  // Frames that were lost in between are not counted: the clock knows better, but not by less than a frame.
  const Time by_frames = format_.period() * static_cast<std::int64_t>(frame_number_ - last_number_);
  const Time between = std::max(by_frames, latched - last_good_at_);
  if (is_possible(format_, last_good_, singleturn, between)) return true;
  if (has_suspect_ && is_possible(format_, suspect_, singleturn, format_.period())) return true;
  has_suspect_ = true;
  suspect_ = singleturn;
  return false;
}

// The frames that came at once were sent one after the other.
Time Listen::latched_time(const Found& found) const {
  if (found.at != heard_at_) return found.at;
  const auto behind = static_cast<std::int64_t>(waiting_.size() - taken_);
  const auto together = static_cast<std::int64_t>(std::max<std::size_t>(waiting_.size(), 1));
  const Time each = format_.period() > Time{} ? format_.period() : (heard_at_ - heard_before_) / together;
  return heard_at_ - behind * each;
}

void Listen::give_up() {
  done_ = true;
  frame_.clear();
  const Error error = !heard_                           ? Error::timeout
                      : decoder_.saw_larger_positions() ? Error::out_of_range
                                                        : Error::bad_framing;
  fail(error, explain_stream(error));
}

void Listen::fail(Error error, const Explanation& words) {
  error_ = error;
  words_ = words;
}

const Reading* Listen::reading() const { return error_ == Error::none && good_ > 0 ? &reading_ : nullptr; }

void Listen::report(FieldSink& sink) const {
  if (reading() == nullptr) return;
  Values values = values_of(format_, {static_cast<std::uint32_t>(reading_.singleturn), format_.own_second_byte()});
  values.skipped = decoder_.skipped();
  fields.put(sink, values);
  sink.put_reading(reading_);
}

Exchange<std::uint8_t> Listen::exchange() const { return {{}, frame_.view(), heard_at_, heard_at_}; }

}  // namespace absenc::raa38::serial
