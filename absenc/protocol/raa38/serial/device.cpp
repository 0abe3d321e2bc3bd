// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/serial/device.hpp"

#include <utility>

namespace absenc::raa38::serial {

ByteStep VirtualEncoder::next(Time now) {
  if (std::exchange(pending_, false)) return character();
  const bool streams = format().mode == Mode::timing && is_on(now) && !is_transmitting();
  if (streams && now >= due_) {
    // If the stream is late by more than `most_backlog`, the encoder drops the frames that it should have sent by now.
    if (now - due_ > most_backlog) due_ = now;
    transmit(encode_position(format(), position(due_)), due_);
    due_ += format().period() > Time{} ? format().period() : virtual_period;
  }
  ByteStep step = BusDevice::next(now);
  if (step.kind == ByteStep::Kind::transfer && format().transmission > Time{}) {
    frame_ = step.out;
    frame_at_ = step.at;
    sent_ = 0;
    return character();
  }
  if (step.kind == ByteStep::Kind::wait && streams && !is_transmitting()) step.at = due_;
  return step;
}

// Returns the step that sends the next character of the frame at its time.
ByteStep VirtualEncoder::character() {
  const auto before = static_cast<std::int64_t>(sent_);
  const Time at = frame_at_ + before * format().transmission / static_cast<std::int64_t>(frame_.size());
  return {.kind = ByteStep::Kind::transfer, .out = frame_.subspan(sent_++, 1), .at = at};
}

void VirtualEncoder::feed(const ByteEvent& event) {
  pending_ = pending_ || (event.kind == ByteEvent::Kind::sent && sent_ < frame_.size());
  if (pending_) return;
  if (event.kind == ByteEvent::Kind::sent) frame_ = {};
  if (event.kind == ByteEvent::Kind::triggered && is_on(event.at)) triggered(event);
  if (event.kind == ByteEvent::Kind::received) {
    if (format().mode != Mode::bus) return;
    if (is_transmitting()) return check_during_transmission(event);
  }
  BusDevice::feed(event);
}

void VirtualEncoder::power_off(Time now) {
  BusDevice::power_off(now);
  frame_ = {};
  pending_ = false;
}

void VirtualEncoder::triggered(const ByteEvent& event) {
  if (event.wire == ExtraWire::clear) {
    if (format().zeroing == Zeroing::line) store_zero(event.at, 0);
    return;
  }
  if (format().mode != Mode::handshake) return;
  if (!expect(event.width >= trigger_width, "pulse on CLK shorter than 10 us (T2)", event.at)) return;
  if (!expect(!is_transmitting(), "pulse on CLK before the last frame was out (T1)", event.at)) return;
  transmit(encode_position(format(), position(event.at)), event.at + Protocol::device_times(format()).answer_time);
}

// Reports a rule violation if a request `BC AA Bx` for this encoder arrives during its transmission.
void VirtualEncoder::check_during_transmission(const ByteEvent& event) {
  const std::uint32_t own = 0xBCAA00u | number_mark | format().unit;
  // If the event was delivered late, the request may have arrived before the transmission; then it breaks no rule.
  const bool may_have_waited = event.late > Protocol::device_times(format()).answer_time + format().transmission;
  for (const std::uint8_t byte : event.items) {
    last_characters_ = (last_characters_ << 8 | byte) & 0xFFFFFF;
    if (last_characters_ == own && !may_have_waited)
      expect(false, "request during the encoder's transmission", event.at);
  }
}

bool VirtualEncoder::is_mine(const Request& request) const {
  if (request.kind == Request::Kind::read) return request.unit == format().unit;
  return format().zeroing == Zeroing::command && request.unit == format().zeroed_unit();
}

std::optional<Position> VirtualEncoder::answer(const Request& request, Time at) {
  if (request.kind == Request::Kind::read) return position(at);
  store_zero(at, 0);
  return std::nullopt;
}

Position VirtualEncoder::position(Time at) const {
  const auto place = static_cast<std::uint64_t>(counts(at, format().bits, 0)) & low_mask(format().bits);
  return {static_cast<std::uint32_t>(place), format().own_second_byte()};
}

}  // namespace absenc::raa38::serial
