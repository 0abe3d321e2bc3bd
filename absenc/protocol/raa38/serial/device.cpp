// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/serial/device.hpp"

#include <algorithm>

namespace absenc::raa38::serial {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

VirtualEncoder::VirtualEncoder(const Settings& settings, const Shaft& shaft) : settings_(settings), shaft_(&shaft) {
  if (settings_.period == Time{}) settings_.period = virtual_period;
  if (settings_.acquisition == Time{}) settings_.acquisition = virtual_acquisition;
}

ByteStep VirtualEncoder::next(Time now) {
  if (on_ && settings_.mode == Mode::timing && !transmitting_ && now >= due_) stream(now);
  if (frame_pending_) return transmit();
  ByteStep step{.expect = 1, .at = never};
  if (on_ && settings_.mode == Mode::timing && !transmitting_) step.at = due_;
  if (!heard_.empty()) step.gap = request_gap;
  return step;
}

// As long as the frame was ordered to take: character by character.
ByteStep VirtualEncoder::transmit() {
  frame_pending_ = false;
  const Bytes rest = frame_.view().subspan(sent_);
  const auto before = static_cast<std::int64_t>(sent_);
  const Time at = frame_at_ + before * settings_.transmission / static_cast<std::int64_t>(frame_.size());
  const Bytes out = settings_.transmission > Time{} ? rest.first(1) : rest;
  sent_ += out.size();
  return {.kind = ByteStep::Kind::transfer, .out = out, .at = at};
}

// What was held up is made up for, so that the rate stays; after a long time there is no use in it.
void VirtualEncoder::stream(Time now) {
  if (now - due_ > most_backlog) due_ = now;
  send(settings_.second_byte(), due_, due_);
  due_ += settings_.period;
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
    if (settings_.zeroing == Zeroing::line) set_zero(event.at);
    return;
  }
  if (settings_.mode != Mode::handshake) return;
  if (event.width < trigger_width) return violate("pulse on CLK shorter than 10 us (T2)", event.at);
  if (transmitting_) return violate("pulse on CLK before the last frame was out (T1)", event.at);
  send(settings_.second_byte(), event.at, event.at + settings_.acquisition);
}

// Others on the bus transmit frames, in which anything may look like a request.
void VirtualEncoder::received(Bytes bytes, Time at) {
  if (settings_.mode != Mode::bus) return;
  for (const std::uint8_t byte : bytes) {
    heard_.push_back(byte);
    if (heard_[0] == header && (heard_.size() < 2 || second_byte_fits(settings_.format, anybody, heard_[1]))) {
      if (heard_.size() == settings_.format.frame_bytes()) heard_.clear();
      continue;
    }
    const RequestBytes request = encode_request({});
    const bool begins = heard_[0] == request[0] && (heard_.size() < 2 || heard_[1] == request[1]);
    if (begins && heard_.size() < request_bytes) continue;
    const Result<Request> complete = decode_request(heard_);
    heard_.clear();
    if (complete) {
      request_received(*complete, at);
    } else if (byte == header || byte == request[0]) {
      heard_.push_back(byte);
    }
  }
}

void VirtualEncoder::request_received(const Request& request, Time at) {
  if (request.kind == Request::Kind::zero_clear) {
    if (settings_.zeroing == Zeroing::command && request.unit == settings_.zero_unit) set_zero(at);
  } else if (request.unit == settings_.unit && transmitting_) {
    violate("request during the encoder's transmission", at);
  } else if (request.unit == settings_.unit) {
    send(settings_.second_byte(), at, at + settings_.acquisition);
  }
}

void VirtualEncoder::set_zero(Time at) {
  store_little_endian(memory_, shaft_counts(at));
  ++memory_version_;
  ++writes_;
}

void VirtualEncoder::send(std::uint8_t second_byte, Time latched, Time at) {
  const auto zero = static_cast<std::uint32_t>(load_little_endian(memory_));
  const auto mask = static_cast<std::uint32_t>(low_mask(settings_.format.bits));
  frame_ = encode_position(settings_.format, {(shaft_counts(latched) - zero) & mask, second_byte});
  frame_at_ = at;
  sent_ = 0;
  frame_pending_ = transmitting_ = true;
  ++answered_;
}

std::uint32_t VirtualEncoder::shaft_counts(Time at) const {
  const auto fraction = static_cast<std::uint32_t>(shaft_->at(at).position);
  return fraction >> (32 - settings_.format.bits);
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
