// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/author/device.hpp"

#include <utility>

namespace absenc::author {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

// ---- Power

void Responder::power_on(Time now, PowerOn kind) {
  power_ = Power::starting;
  ready_at_ = kind == PowerOn::skip ? now : now + times_.start_time;
  static_cast<void>(is_on(now));
}

void Responder::power_off(Time now) {
  if (is_on(now)) stopped(now);
  power_ = Power::off;
  forget();
  refusing_ = reply_pending_ = transmitting_ = false;
}

void Responder::restart(Time until) {
  power_ = Power::starting;
  ready_at_ = until;
}

bool Responder::is_on(Time now) {
  if (power_ == Power::starting && now >= ready_at_) {
    power_ = Power::on;
    started(ready_at_);
  }
  return power_ == Power::on;
}

// ---- The line

ByteStep Responder::next(Time) {
  if (reply_pending_) {
    reply_pending_ = false;
    return {.kind = ByteStep::Kind::transfer, .out = reply_, .at = reply_at_};
  }
  ByteStep step{.expect = 1, .at = never};
  if (!request_.empty()) step.expect = request_size(request_) - request_.size();
  if (!request_.empty() || skipping_ != 0 || refusing_) {
    step.gap = times_.gap != Time{} ? times_.gap : 2 * times_.character;
  }
  return step;
}

void Responder::feed(const ByteEvent& event) {
  switch (event.kind) {
    case ByteEvent::Kind::received:
      for (const std::uint8_t byte : event.items) hear(byte, event.at);
      break;
    case ByteEvent::Kind::sent:
      transmitting_ = false;
      break;
    case ByteEvent::Kind::silence:
    case ByteEvent::Kind::line_error:
      broken_off(event);
      break;
    default:
      break;
  }
}

void Responder::forget() {
  request_.clear();
  skipping_ = 0;
}

// What was begun is no request.
void Responder::broken_off(const ByteEvent& event) {
  const bool silent = event.kind == ByteEvent::Kind::silence;
  if (!is_on(event.at) || transmitting_) return forget();
  if (!silent) heard_at_ = event.at;
  const bool refused = !(silent && request_.empty()) && is_refused(silent ? Flaw::cut_short : Flaw::damaged, request_);
  refusing_ = refusing_ || refused;
  forget();
  if (!silent || !std::exchange(refusing_, false)) return;
  reply_.clear();
  refuse(event.at, reply_);
  answer(heard_at_);
}

void Responder::answer(Time from) {
  reply_at_ = from + times_.answer_time;
  reply_pending_ = transmitting_ = true;
  interruption_.begin();
  ++answered_;
}

void Responder::hear(std::uint8_t byte, Time at) {
  if (!is_on(at)) return;
  if (transmitting_) {
    if (interruption_.begins_request(request_size({&byte, 1}), at, times_.character)) {
      violate("request during the encoder's transmission", at);
    }
    return;
  }
  heard_at_ = at;
  if (refusing_) return;
  if (skipping_ != 0) {
    --skipping_;
    return;
  }
  request_.push_back(byte);
  const std::size_t size = request_size(request_);
  if (size == 0) {
    refusing_ = is_refused(Flaw::unknown, request_);
    return request_.clear();
  }
  if (request_.size() < size) return;
  reply_.clear();
  switch (respond(request_, at, reply_)) {
    case Answer::sent:
      answer(at);
      break;
    case Answer::refused:
      refusing_ = true;
      break;
    case Answer::none:
      ++answered_;
      break;
    case Answer::for_others:
      skipping_ = others_reply_size(request_);
      break;
  }
  request_.clear();
}

void Responder::violate(std::string_view rule, Time at) {
  violations_.push_back({rule, at});
  ++violation_count_;
}

}  // namespace absenc::author
