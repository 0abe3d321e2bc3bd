// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/echo.hpp"

#include <algorithm>

namespace absenc::host {

namespace {

bool begins_with(Bytes bytes, Bytes start) {
  const std::size_t common = std::min(bytes.size(), start.size());
  return std::equal(start.begin(), start.begin() + static_cast<std::ptrdiff_t>(common), bytes.begin());
}
}  // namespace

void EchoFilter::conclude(bool good) {
  if (mode_ == EchoMode::automatic && good) mode_ = detected_;
  detected_ = EchoMode::automatic;
}

ByteStep EchoFilter::next(Time now) {
  ByteStep step = inner_->next(now);
  if (step.kind == ByteStep::Kind::transfer) {
    sent_.clear();
    held_.clear();
    echoed_ = 0;
    // A request that does not fit is longer than any request of a supported protocol: its echo is not removed.
    if (!sent_.append(step.out)) return step;
    reply_due_ = step.expect;
    echo_due_ = working_mode() == EchoMode::on ? sent_.size() : 0;
    passed_ = only_echo_ = false;
  }
  const bool waiting = step.kind == ByteStep::Kind::transfer || step.kind == ByteStep::Kind::wait;
  if (!waiting || working_mode() == EchoMode::off || sent_.empty()) return step;
  if (step.expect != 0) {
    step.expect += working_mode() == EchoMode::on ? echo_due_ : sent_.size() - std::min(sent_.size(), held_.size());
  }
  // Between the echo and the reply the encoder may need its answer time, so the `gap` limit must not be shorter than
  // the `answer` limit.
  if (!passed_) step.gap = std::max(step.gap, step.answer);
  return step;
}

void EchoFilter::feed(const ByteEvent& event) {
  if (event.kind == ByteEvent::Kind::received) return received(event);
  if (event.kind == ByteEvent::Kind::silence && working_mode() == EchoMode::automatic && !held_.empty()) {
    decide(event.at);
  }
  if (event.kind == ByteEvent::Kind::silence && working_mode() == EchoMode::on && !passed_ && echo_due_ == 0) {
    only_echo_ = !sent_.empty();
  }
  inner_->feed(event);
}

void EchoFilter::received(const ByteEvent& event) {
  if (sent_.empty()) return inner_->feed(event);  // no request is stored, so no echo can arrive
  switch (working_mode()) {
    case EchoMode::off:
      inner_->feed(event);
      break;
    case EchoMode::on:
      strip(event);
      break;
    case EchoMode::automatic:
      hold(event);
      break;
  }
}

void EchoFilter::strip(const ByteEvent& event) {
  const std::size_t echoed = std::min(echo_due_, event.items.size());
  const std::size_t at = sent_.size() - echo_due_;
  const Bytes expected = sent_.view().subspan(at, echoed);
  echo_due_ -= echoed;
  echoed_ += echoed;
  if (!std::equal(expected.begin(), expected.end(), event.items.begin())) {
    inner_->feed({.kind = ByteEvent::Kind::line_error, .at = event.at});
  }
  pass(event.at, event.items.subspan(echoed));
}

void EchoFilter::hold(const ByteEvent& event) {
  if (!held_.append(event.items) || !begins_with(held_, sent_)) {
    detected_ = EchoMode::off;
    const ByteBuffer<capacity> held = held_;
    held_.clear();
    return pass(event.at, held);
  }
  if (reply_due_ != 0 && held_.size() >= reply_due_ + sent_.size()) decide(event.at);
}

bool EchoFilter::is_reply(Bytes bytes) const {
  return unit_ != nullptr && unit_->check(*options_, {.bytes = sent_}, {.bytes = bytes}) == Error::none;
}

// Decides whether the held bytes, which begin like the request, begin with its echo.
void EchoFilter::decide(Time at) {
  const std::size_t echo = sent_.size();
  const bool echo_and_reply = held_.size() >= reply_due_ + echo;
  const bool echo_alone = held_.size() == echo && reply_due_ != echo;
  const ByteBuffer<capacity> held = held_;
  held_.clear();
  const Bytes bytes = held;
  const std::size_t reply = reply_due_ != 0 ? std::min(reply_due_, bytes.size()) : bytes.size();
  const bool has_no_echo = echo_and_reply && is_reply(bytes.first(reply)) && !is_reply(bytes.subspan(echo));
  if ((echo_and_reply || echo_alone) && !has_no_echo) {
    detected_ = EchoMode::on;
    echo_due_ = 0;
    echoed_ = echo;
    return pass(at, bytes.subspan(echo));
  }
  detected_ = EchoMode::off;
  if (!has_no_echo) return pass(at, bytes);
  // Bytes beyond the length of the reply do not belong to it, so they are passed on separately.
  pass(at, bytes.first(reply));
  pass(at, bytes.subspan(reply));
}

void EchoFilter::pass(Time at, Bytes bytes) {
  if (bytes.empty()) return;
  passed_ = true;
  inner_->feed({.kind = ByteEvent::Kind::received, .at = at, .items = bytes});
}

}  // namespace absenc::host
