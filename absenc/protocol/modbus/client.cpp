// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/modbus/client.hpp"

#include <algorithm>

namespace absenc::modbus {

namespace {

using ByteStep = Step<std::uint8_t>;

constexpr Time noise_limit = 1s;  // longer than any reply, and than carriers are late to tell silence

}  // namespace

void Client::ask(Bytes request, Time pause) {
  request_.clear();
  request_.append(request);
  reply_.clear();
  give_up_ = never;
  pause_ = pause;
  state_ = State::ready;
}

void Client::set_rate(std::uint32_t rate) {
  line_.rate = rate;
  setting_rate_ = true;
}

void Client::finish(Error error, const Explanation& explanation) {
  error_ = error;
  explanation_ = error == Error::none ? Explanation{} : explanation;
  state_ = State::done;
}

ByteStep Client::next(Time now) {
  // What was on the line before this conversation is not known: the silence begins now.
  if (!begun_) received_at_ = now;
  begun_ = true;
  const bool hearing = state_ == State::settling || (!reply_.empty() && state_ != State::done);
  if (hearing && give_up_ == never) give_up_ = now + noise_limit;
  if (hearing && now >= give_up_) give_up();
  if (setting_rate_) {
    setting_rate_ = false;
    return {.kind = ByteStep::Kind::configure, .settings = line_};
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
      state_ = State::sending;
      disturbed_ = false;
      reply_.clear();
      give_up_ = never;
      step.expect = expected({});
      step.kind = ByteStep::Kind::transfer;
      step.out = request_;
      step.at = now;
      break;
    case State::sending:
      break;
    case State::receiving:
    case State::settling:
      step.at = give_up_;
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

void Client::give_up() {
  finish(Error::wrong_length, {"something sends without a pause", "find the node that does not stop"});
}

void Client::conclude() {
  Error error = reply_.empty() ? Error::timeout : check(reply_);
  if (disturbed_) error = reply_.empty() ? Error::bad_framing : Error::wrong_length;
  if (error == Error::none) return answered(reply_);
  failed(error, reply_);
}

}  // namespace absenc::modbus
