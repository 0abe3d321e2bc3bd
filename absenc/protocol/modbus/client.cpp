// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/modbus/client.hpp"

#include <algorithm>

namespace absenc::modbus {

namespace {

using ByteStep = Step<std::uint8_t>;

constexpr Time patience = 1s;  // longer than any reply, and than carriers are late to tell silence

}  // namespace

Client::Client(const LineSettings& line, Time answer_limit)
    : RequestReply(patience), line_(line), answer_limit_(answer_limit) {}

void Client::ask(Bytes request, Time pause) {
  request_.clear();
  request_.append(request);
  reply_.clear();
  clear_noise();
  pause_ = pause;
  state_ = State::ready;
}

void Client::set_rate(std::uint32_t rate) {
  line_.rate = rate;
  setting_rate_ = true;
}

void Client::finish(Error error, const Explanation& explanation) {
  error_ = error;
  explanation_ = error == Error::none ? Explanation{} : explanation.found.empty() ? noise_explanation() : explanation;
  state_ = State::done;
}

ByteStep Client::next(Time now) {
  // What was on the line before this conversation is not known: the silence begins now.
  if (!begun_) received_at_ = now;
  begun_ = true;
  if (setting_rate_) {
    setting_rate_ = false;
    return {.kind = ByteStep::Kind::configure, .settings = {.rate = line_.rate}};
  }
  // Whatever is heard meanwhile begins the silence anew.
  const Time due = received_at_ + std::max(request_silence(line_), pause_);
  if (state_ == State::ready && now < due) return {.at = due};
  ByteStep step{.at = never, .answer = answer_limit_ + line_.character(), .gap = frame_silence(line_)};
  if (state_ == State::ready || state_ == State::receiving) {
    step.expect = std::max(expected(reply_), reply_.size()) - reply_.size();
  }
  switch (state_) {
    case State::ready:
      begin_request();
      reply_.clear();
      step.expect = expected({});
      step.kind = ByteStep::Kind::transfer;
      step.out = request_;
      step.at = now;
      break;
    case State::sending:
    case State::receiving:
    case State::settling:
      break;
    case State::ending:
    case State::done:
      step.kind = ByteStep::Kind::done;
      break;
  }
  return step;
}

void Client::received(Bytes bytes) {
  for (const std::uint8_t byte : bytes) reply_.push_back(byte);
  if (state_ != State::receiving || reply_.size() < expected(reply_)) return;
  // After anything that is wrong more may be coming: what comes of it must not meet the next request.
  if (reply_.size() == expected(reply_) && check(reply_) == Error::none) return answered(reply_);
  state_ = State::settling;
}

void Client::conclude() {
  if (is_noisy()) return failed(Error::wrong_length, reply_);
  Error error = reply_.empty() ? Error::timeout : check(reply_);
  if (disturbed_) error = reply_.empty() ? Error::bad_framing : Error::wrong_length;
  if (error == Error::none) return answered(reply_);
  failed(error, reply_);
}

}  // namespace absenc::modbus
