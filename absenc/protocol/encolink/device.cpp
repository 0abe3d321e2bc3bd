// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/device.hpp"

#include <algorithm>

namespace absenc::encolink {

namespace {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

constexpr std::string_view part_text = "MB080SLA20MENT00";  // 16 characters; [8..9] hold the resolution

}  // namespace

// It answers while it starts: with zeros.
VirtualEncoder::VirtualEncoder(const Format& format, const Shaft& shaft)
    : Responder({.character = uart_settings.character(), .answer_time = answer_time}), format_(format), shaft_(&shaft) {
  if (format_.resolution == 0) format_.resolution = virtual_format.resolution;
  if (format_.multiturn_bits < 0) format_.multiturn_bits = virtual_format.multiturn_bits;
  for (std::size_t i = 0; i < conditions.size(); ++i) conditions_[i] = conditions[i].normal;
}

// ---- The line

ByteStep VirtualEncoder::next(Time now) {
  const bool streams = format_.stream_rate > 0 && format_.wire == Wire::uart;
  update(now);
  if (streams && is_on(now) && !is_transmitting()) {
    if (now < next_frame_) return {.at = next_frame_};
    const Time at = std::max(now, next_frame_);
    transmit(make_frame(now), at);
    next_frame_ = at + Time(1'000'000'000 / format_.stream_rate);
  }
  return Responder::next(now);
}

void VirtualEncoder::feed(const ByteEvent& event) {
  update(event.at);
  const bool received = event.kind == ByteEvent::Kind::received;
  if (format_.wire == Wire::uart) {
    if (!received || format_.stream_rate == 0) Responder::feed(event);
    return;
  }
  if (event.kind == ByteEvent::Kind::selected) selected(event.at);
  if (received && is_on(event.at) && event.items.size() >= request_bytes) handle(event.items, event.at);
  if (event.kind != ByteEvent::Kind::sent) return;
  Responder::feed(event);
  stopped_clocking(event);
}

VirtualEncoder::Answer VirtualEncoder::respond(Bytes request, Time at, ByteBuffer<64>& reply) {
  const ReplyBytes frame = make_frame(at);
  reply.append(frame);
  // Whoever asks with the vendor's library reads as many bytes as the identity may have, twice.
  const bool identifies = frame.size() == identity_bytes || request[0] == static_cast<std::uint8_t>(Config::identify);
  while (identifies && reply.size() < format_.identity_size && format_.identity_size > identity_bytes) {
    reply.push_back(0);
  }
  handle(request, at);
  return Answer::sent;
}

void VirtualEncoder::selected(Time at) {
  if (was_selected_ && at - pause_since_ < spi_pause) violate("NCS high for less than 5 us", at);
  was_selected_ = true;
  if (is_on(at)) transmit(make_frame(at), at);
}

void VirtualEncoder::stopped_clocking(const ByteEvent& event) {
  pause_since_ = event.at;
  if (event.bits > 0 && event.lead < spi_lead) violate("clock less than 5 us after NCS went low", event.at);
  if (event.width > Time{} && event.width < shortest_clock) violate("clock faster than 4 MHz", event.at);
}

ReplyBytes VirtualEncoder::make_frame(Time now) {
  if (now < zeros_until_) return encode_position(format_, {});
  if (identity_next_) {
    identity_next_ = false;
    return encode_identity(identity());
  }
  Position position = measure(now);
  position.channel2 = next_channel2(position, now);
  return encode_position(format_, position);
}

Identity VirtualEncoder::identity() const {
  Identity identity{.protocol_version = format_.generation == Generation::aksim4 ? version::aksim4 : version::aksim2,
                    .frame_bytes = static_cast<std::uint8_t>(format_.turns_bytes() != 0 ? 7 : 5),
                    .resolution = format_.resolution};
  std::copy(part_text.begin(), part_text.end(), identity.text.begin() + 2);
  return identity;
}

// The frame that goes out with this request was made before: what it asks for shows in the next one.
void VirtualEncoder::handle(Bytes request, Time at) {
  if (at < zeros_until_) return;
  const auto config = static_cast<Config>(request[0]);
  if (config != Config::reset_channels && config != Config::identify) return ra_received(request[1], at);
  identity_next_ = identity_next_ || config == Config::identify;
  reset_channels();
}

// ---- Channels 2 and 3

void VirtualEncoder::reset_channels() {
  cycle_index_ = 0;
  access_.clear();
  answer_.clear();
  answered_bytes_ = 0;
}

std::uint8_t VirtualEncoder::next_channel2(const Position& position, Time now) {
  const std::size_t size = format_.cycle_bytes();
  if (cycle_index_ == 0) {
    cycle_content_ = {position, alarms(), 0};
    if (conditions_[condition_channels_disagree] != 0) cycle_content_.position.singleturn ^= 1;
  }
  if (cycle_index_ == size - 2) cycle_content_.channel3 = next_channel3(now);
  if (cycle_index_ == 0 || cycle_index_ == size - 2) cycle_ = encode_cycle(format_, cycle_content_);
  const std::uint8_t byte = cycle_[cycle_index_];
  cycle_index_ = (cycle_index_ + 1) % size;
  return byte;
}

std::uint8_t VirtualEncoder::next_channel3(Time now) {
  if (answered_bytes_ == answer_.size()) return channel3::idle;
  if (now < busy_until_ || conditions_[condition_busy] != 0) return channel3::busy;
  return answer_[answered_bytes_++];
}

void VirtualEncoder::ra_received(std::uint8_t byte, Time at) {
  if (access_.size() < access_keys.size() && byte != access_keys[access_.size()]) access_.clear();
  if (access_.empty() && byte != access_keys[0]) return;
  access_.push_back(byte);
  if (access_.size() == 2 && answered_bytes_ != answer_.size()) {
    violate("register access before the last one was answered", at);
    access_.clear();
  }
  if (access_.size() < access_header) return;
  const auto length = static_cast<std::size_t>(load_big_endian(access_.view().subspan(access_keys.size() + 1, 2)));
  const bool writes = access_[access_keys.size()] == static_cast<std::uint8_t>(RegisterRequest::Operation::write);
  if (access_.size() == access_header + (writes ? std::min(length, access_capacity) : 0) + 1) execute(at);
}

// ---- State

// Of the shaft with the offset, as if the turn counter had no end: 2^-32 revolution.
std::int64_t VirtualEncoder::place(Time now) const {
  const auto fraction = static_cast<std::int32_t>(format_.offset_fraction(offset()));
  const std::int64_t position = shaft_->at(now).position;
  return format_.offset_sign == OffsetSign::add ? position + fraction : position - fraction;
}

Position VirtualEncoder::measure(Time now) const {
  const std::int64_t here = place(now);
  const auto turns = static_cast<std::uint32_t>(here >> 32) - values_[turns_taken];
  Position position;
  position.singleturn = static_cast<std::uint32_t>(here) >> (32 - format_.resolution);
  position.multiturn = static_cast<std::uint16_t>(turns & low_mask(static_cast<unsigned>(format_.multiturn_bits)));
  position.error = (alarms() & status::errors) != 0;
  position.warning = (alarms() & status::warnings) != 0;
  return position;
}

// Brings everything that changes with time up to now.
void VirtualEncoder::update(Time now) {
  if (save_pending_ && now >= busy_until_) save();
  if (calibrating_ && now >= calibrated_at_) end_calibration(now);
}

void VirtualEncoder::end_calibration(Time now) {
  calibrating_ = false;
  const std::int64_t turned = shaft_->at(now).position - calibrated_from_;
  constexpr std::int64_t one_turn = std::int64_t{1} << 32;
  if (turned < one_turn && -turned < one_turn) {
    calibration_status_ |= calibration::timed_out;
  } else {
    calibration_status_ = static_cast<std::uint8_t>((calibration_status_ + 1) & calibration::count);
  }
}

// ---- Power

void VirtualEncoder::power_on(Time now, PowerOn kind) {
  load();
  zeros_until_ = next_frame_ = now;
  if (kind == PowerOn::real) zeros_until_ += start_up;
  busy_until_ = Time{};
  calibration_status_ = 0;
  reset_channels();
  Responder::power_on(now, kind);
}

void VirtualEncoder::stopped(Time now) {
  update(now);
  save_pending_ = calibrating_ = identity_next_ = false;
}

}  // namespace absenc::encolink
