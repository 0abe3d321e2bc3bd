// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/serial/device.hpp"

#include <algorithm>

#include "absenc/protocol/raa38/serial/timing.hpp"

namespace absenc::raa38::serial {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

VirtualEncoder::VirtualEncoder(const Format& format, const Shaft& shaft)
    : format_(format), period_(format.period() > Time{} ? format.period() : virtual_period), shaft_(&shaft) {
  if (format_.acquisition == Time{}) format_.acquisition = virtual_acquisition;
}

ByteStep VirtualEncoder::next(Time now) {
  if (on_ && format_.mode == Mode::timing && !transmitting_ && now >= due_) stream(now);
  if (frame_pending_) return transmit();
  ByteStep step{.expect = 1, .at = never};
  if (on_ && format_.mode == Mode::timing && !transmitting_) step.at = due_;
  if (!heard_.empty()) step.gap = request_gap;
  return step;
}

// As long as the frame was ordered to take: character by character.
ByteStep VirtualEncoder::transmit() {
  frame_pending_ = false;
  const Bytes rest = frame_.view().subspan(sent_);
  const auto before = static_cast<std::int64_t>(sent_);
  const Time at = frame_at_ + before * format_.transmission / static_cast<std::int64_t>(frame_.size());
  const Bytes out = format_.transmission > Time{} ? rest.first(1) : rest;
  sent_ += out.size();
  return {.kind = ByteStep::Kind::transfer, .out = out, .at = at};
}

// What was held up is made up for, so that the rate stays; after a long time there is no use in it.
void VirtualEncoder::stream(Time now) {
  if (now - due_ > most_backlog) due_ = now;
  send(format_.own_second_byte(), due_, due_);
  due_ += period_;
}

void VirtualEncoder::feed(const ByteEvent& event) {
  switch (event.kind) {
    case ByteEvent::Kind::sent:
      transmitting_ = frame_pending_ = sent_ < frame_.size();
      break;
    case ByteEvent::Kind::received:
      if (on_) received(event.items, event.at);
      break;
    case ByteEvent::Kind::triggered:
      if (on_) triggered(event);
      break;
    case ByteEvent::Kind::silence:
    case ByteEvent::Kind::line_error:
      heard_.clear();
      break;
    default:
      break;
  }
}

void VirtualEncoder::triggered(const ByteEvent& event) {
  if (event.line == Line::clear) {
    if (format_.zeroing == Zeroing::line) set_zero(event.at);
    return;
  }
  if (format_.mode != Mode::handshake) return;
  if (event.width < trigger_width) return violate("pulse on CLK shorter than 10 us (T2)", event.at);
  if (transmitting_) return violate("pulse on CLK before the last frame was out (T1)", event.at);
  send(format_.own_second_byte(), event.at, event.at + format_.acquisition);
}

// Others on the bus transmit frames, which may hold the begin of a request; their sums make no whole one of it.
void VirtualEncoder::received(Bytes bytes, Time at) {
  if (format_.mode != Mode::bus) return;
  for (const std::uint8_t byte : bytes) {
    heard_.push_back(byte);
    const RequestBytes request = encode_request({});
    const bool begins = heard_[0] == request[0] && (heard_.size() < 2 || heard_[1] == request[1]);
    if (begins && heard_.size() < request_bytes) continue;
    const Result<Request> complete = decode_request(heard_);
    heard_.clear();
    if (complete) {
      request_received(*complete, at);
    } else if (byte == request[0]) {
      heard_.push_back(byte);
    }
  }
}

void VirtualEncoder::request_received(const Request& request, Time at) {
  if (request.kind == Request::Kind::zero_clear) {
    if (format_.zeroing == Zeroing::command && request.unit == format_.zeroed_unit()) set_zero(at);
  } else if (request.unit == format_.unit && transmitting_) {
    violate("request during the encoder's transmission", at);
  } else if (request.unit == format_.unit) {
    send(format_.own_second_byte(), at, at + format_.acquisition);
  }
}

void VirtualEncoder::set_zero(Time at) {
  store_little_endian(memory_, shaft_counts(at));
  ++memory_version_;
  ++writes_;
}

void VirtualEncoder::send(std::uint8_t second_byte, Time latched, Time at) {
  const auto zero = static_cast<std::uint32_t>(load_little_endian(memory_));
  const auto mask = static_cast<std::uint32_t>(low_mask(format_.bits));
  frame_ = encode_position(format_, {(shaft_counts(latched) - zero) & mask, second_byte});
  frame_at_ = at;
  sent_ = 0;
  frame_pending_ = transmitting_ = true;
  ++answered_;
}

std::uint32_t VirtualEncoder::shaft_counts(Time at) const {
  const auto fraction = static_cast<std::uint32_t>(shaft_->at(at).position);
  return fraction >> (32 - format_.bits);
}

void VirtualEncoder::violate(std::string_view rule, Time at) {
  violations_.push_back({rule, at});
  ++violation_count_;
}

// No start-up time is stated.
void VirtualEncoder::power_on(Time now, PowerOn) {
  if (on_) return;
  on_ = true;
  due_ = now;
  heard_.clear();
}

void VirtualEncoder::power_off(Time) {
  on_ = false;
  frame_pending_ = transmitting_ = false;
  sent_ = frame_.size();
}

}  // namespace absenc::raa38::serial
