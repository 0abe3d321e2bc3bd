// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/author/device.hpp"

#include <algorithm>
#include <utility>

namespace absenc::author {

namespace {
constexpr std::string_view turn_rule = "request during the encoder's transmission";
// Shortest time that a host is assumed to wait for a reply, because a pseudo-terminal alone may delay a reply by this
// time.
constexpr Time least_patience = std::chrono::milliseconds(1);
// Greatest number of consecutive replies during which a request of the host is no rule breach, because this program may
// have sent the reply too late.
constexpr unsigned most_excuses = 2;
}  // namespace

void Responder::power_off(Time now) {
  EncoderOn::power_off(now);
  forget();
  stored_.clear();
  refusing_ = reply_pending_ = transmitting_ = false;
}

// ---- The line

ByteStep Responder::next(Time) {
  if (reply_pending_) {
    reply_pending_ = false;
    return {.kind = ByteStep::Kind::transfer, .out = reply_, .at = reply_at_};
  }
  ByteStep step{.expect = 1, .at = never};
  // While this encoder skips the reply of another encoder, no bytes are expected, because that encoder may be absent:
  // any pause ends its reply.
  if (damaged_ || skipping_ != 0) step.expect = 0;
  if (!damaged_ && !request_.empty()) step.expect = request_size(request_) - request_.size();
  if (damaged_ || !request_.empty() || skipping_ != 0 || refusing_) {
    step.gap = times_.gap != Time{} ? times_.gap : 2 * times_.character;
  }
  return step;
}

void Responder::feed(const ByteEvent& event) {
  switch (event.kind) {
    case ByteEvent::Kind::received:
      late_ = event.late;
      for (const std::uint8_t byte : event.items) receive_byte(byte, event.at);
      break;
    case ByteEvent::Kind::sent: {
      transmitting_ = false;
      replied(event.at);
      const ByteBuffer<64> kept = stored_;
      stored_.clear();
      for (const std::uint8_t byte : kept.view()) receive_byte(byte, event.at);
      break;
    }
    case ByteEvent::Kind::line_error:
      damage(event.at);
      break;
    case ByteEvent::Kind::silence:
      end_run(event.at);
      break;
    default:
      break;
  }
}

void Responder::forget() {
  request_.clear();
  skipping_ = 0;
  skip_begins_ = damaged_ = false;
}

void Responder::damage(Time at) {
  if (!is_on(at) || transmitting_) return forget();
  received_at_ = at;
  damaged_ = true;
  refusing_ = is_refused(Flaw::damaged, request_) || refusing_;
}

void Responder::end_run(Time at) {
  reply_.clear();
  if (is_on(at) && !transmitting_) {
    if (!damaged_ && !request_.empty()) refusing_ = is_refused(Flaw::cut_short, request_) || refusing_;
    if (std::exchange(refusing_, false)) {
      refuse(at, reply_);
      begin_reply(received_at_ + times_.answer_time);
    }
  }
  forget();
}

void Responder::receive_byte(std::uint8_t byte, Time at) {
  if (!is_on(at) || at < turns_end_) return;
  if (transmitting_ && times_.keeps_requests) {
    stored_.push_back(byte);
    return;
  }
  if (transmitting_) return receive_while_transmitting(byte, at);
  const Time before = std::exchange(received_at_, at);
  if (damaged_ || refusing_) return;
  if (std::exchange(skip_begins_, false) && !begins_others_reply(byte)) skipping_ = 0;
  if (skipping_ != 0) {
    --skipping_;
    return;
  }
  check_frame_pause(at, before);
  request_.push_back(byte);
  const std::size_t size = request_size(request_);
  if (size == 0) return search_again(at);
  if (request_.size() < size) return;
  if (answer_count() > 0) expect(true, turn_rule, at);
  reply_.clear();
  longer_ = {};
  turns_ = {};
  ended(respond(request_, at, reply_), at);
  request_.clear();
}

// Checks the pause that a host must keep before each further frame of a request. Nothing is checked if the frames were
// delivered together, because the pause is then unknown.
void Responder::check_frame_pause(Time at, Time before) {
  if (times_.frame == 0 || request_.empty() || request_.size() % times_.frame != 0 || at == before) return;
  expect(at - times_.character - (before - late_) >= times_.frame_pause, times_.frame_rule, at);
}

// Drops the first received byte, at which no request begins, and searches for a request from the second byte on.
void Responder::search_again(Time at) {
  refusing_ = is_refused(Flaw::unknown, request_);
  const ByteBuffer<32> heard = request_;
  request_.clear();
  if (refusing_) return;
  for (const std::uint8_t byte : heard.view().subspan(1)) receive_byte(byte, at);
}

// Reports a request during the encoder's reply as a rule breach, unless this program may have been delayed so long that
// the host rightly repeated its request.
void Responder::receive_while_transmitting(std::uint8_t byte, Time at) {
  if (!interruption_.begins_request(request_size({&byte, 1}), at, times_.character)) return;
  ++interrupted_;
  const Time reply_time = times_.answer_time + static_cast<int>(reply_.size()) * times_.character;
  const bool may_have_waited = late_ > static_cast<int>(interrupted_) * std::max(reply_time, least_patience);
  const bool excused = may_have_waited && interruptions_in_a_row_ < most_excuses;
  if (!excused) expect(false, turn_rule, at);
}

void Responder::ended(Answer answer, Time at) {
  switch (answer) {
    case Answer::sent:
      begin_reply(at + times_.answer_time + longer_);
      turns_end_ = turns_ == Time{} ? Time{} : at + times_.answer_time + turns_;
      break;
    case Answer::refused:
      refusing_ = true;
      break;
    case Answer::none:
      count_answer();
      break;
    case Answer::for_others:
      skipping_ = others_reply_size(request_);
      skip_begins_ = true;
      break;
  }
}

void Responder::begin_reply(Time at) {
  reply_at_ = at;
  reply_pending_ = transmitting_ = true;
  interruption_.begin();
  interruptions_in_a_row_ = interrupted_ > 0 ? interruptions_in_a_row_ + 1 : 0;
  interrupted_ = 0;
  count_answer();
}

void Responder::transmit(Bytes bytes, Time at) {
  reply_.clear();
  reply_.append(bytes);
  begin_reply(at);
}

}  // namespace absenc::author
