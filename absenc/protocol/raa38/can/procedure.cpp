// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/can/procedure.hpp"

#include <algorithm>

namespace absenc::raa38::can {

namespace {
using FrameStep = Step<CanFrame>;
using FrameEvent = Event<CanFrame>;

constexpr std::string_view check_bus =
    "check supply, CANH and CANL, 120 ohms at both ends, the bit rate, and that no two nodes have one number";
}  // namespace

void Procedure::ask(const CanFrame& frame, Time pause) {
  request_ = frame;
  has_request_ = true;
  has_relevant_ = false;
  exact_ = false;
  duration_ = busy_limit;
  pause_ = pause;
  state_ = State::ready;
}

void Procedure::ask_for(const CanFrame& frame, Time duration) {
  ask(frame);
  exact_ = true;
  duration_ = duration;
}

void Procedure::listen(Time duration) {
  exact_ = true;
  duration_ = duration;
  disturbed_ = false;
  since_ = now_;
  until_ = now_ + duration;
  state_ = State::hearing;
}

void Procedure::configure(std::uint32_t rate, Time duration) {
  settings_ = {.rate = rate};
  duration_ = duration;
  state_ = State::configuring;
}

void Procedure::finish(Error error, const Explanation& explanation) {
  error_ = error;
  explanation_ = explanation;
  state_ = State::done;
}

void Procedure::fail(Error error) {
  const CanFrame* reply = has_relevant_ ? &relevant_ : nullptr;
  finish(error, explain_frame(error, has_request_ ? &request_ : nullptr, reply));
}

void Procedure::keep(const CanFrame& frame, Time at) {
  relevant_ = frame;
  relevant_at_ = at;
  has_relevant_ = true;
}

void Procedure::feed(const FrameEvent& event) {
  using Kind = FrameEvent::Kind;
  now_ = std::max(now_, event.at);
  switch (event.kind) {
    case Kind::sent:
      if (state_ != State::sending) break;
      sent_at_ = since_ = event.at;
      if (!has_relevant_) relevant_at_ = event.at;
      until_ = event.at + duration_;
      state_ = State::hearing;
      break;
    case Kind::received:
      // A frame that was complete before the request cannot answer it: it may have waited in a queue for long.
      if (state_ != State::hearing || event.at < since_) break;
      for (const CanFrame& frame : event.items) {
        if (state_ == State::hearing) heard(frame, event.at);
      }
      break;
    case Kind::line_error:
      disturbed_ = true;
      break;
    case Kind::silence:
      if (state_ == State::hearing && !exact_) over();
      break;
    default:
      break;
  }
}

FrameStep Procedure::next(Time now) {
  now_ = std::max(now_, now);
  if (!started_) {
    started_ = true;
    if (state_ == State::hearing) listen(duration_);  // from now on
  }
  if (state_ == State::hearing && now >= until_) over();
  FrameStep step{.at = never};
  if (!exact_) step.answer = step.gap = answer_limit;
  switch (state_) {
    case State::ready:
      state_ = State::sending;
      disturbed_ = false;
      step.kind = FrameStep::Kind::transfer;
      step.out = {&request_, 1};
      step.expect = 1;
      step.answer = exact_ ? duration_ : answer_limit;
      step.at = pause_ > Time{} ? now_ + pause_ : Time{};
      break;
    case State::sending:
      break;
    case State::hearing:
      step.at = until_;
      break;
    case State::configuring:
      listen(duration_);
      step.kind = FrameStep::Kind::configure;
      step.settings = settings_;
      break;
    case State::done:
      step.kind = FrameStep::Kind::done;
      break;
  }
  return step;
}

Explanation explain_frame(Error error, const CanFrame* request, const CanFrame* reply) {
  if (reply == nullptr && request != nullptr) {
    switch (error) {
      case Error::bad_framing:
        if (request->remote) break;
        return {"frames are destroyed on the bus", check_bus};
      case Error::timeout:
        return {{},
                "check supply, CANH and CANL, 120 ohms at both ends, the bit rate and the node: `scan` asks them all"};
      case Error::cross_check_failed:
        return {"the identifier and the second byte name different nodes", {}};
      case Error::unsupported:
        return {"the first byte is none of the commands that the document has", {}};
      case Error::unexpected_reply:
        return {"nobody sends such a frame to this encoder: its identifiers are 2NN and 7E5",
                "what a node sends is a reply, not a request"};
      default:
        break;
    }
  }
  const CanFrame* frame = reply != nullptr ? reply : request;
  if (frame == nullptr) return {};
  if (frame->remote) return {"it is a remote frame, and these encoders know none", {}};
  switch (error) {
    case Error::wrong_length:
      return {"every frame of this encoder has 8 bytes of data", {}};
    case Error::unexpected_reply:
      if (frame->extended) return {"its identifier has 29 bits, those of this encoder have 11", {}};
      if (function_of(*frame) == Function::command) {
        return {"it is what a node is sent, not what it sends", "give it as the request"};
      }
      if (function_of(*frame) == Function::unknown) return {"none of this encoder's frames has that identifier", {}};
      return {};
    case Error::out_of_range:
      if (function_of(*frame) == Function::reply)
        return {"the position has more bits than the encoder", "set bits=10 to 21"};
      return {};
    case Error::request_rejected:
      return {"its second byte is an error code of CiA 305 (1: value not supported)", {}};
    default:
      return {};
  }
}

}  // namespace absenc::raa38::can
