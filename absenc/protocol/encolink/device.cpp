// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/device.hpp"

#include <algorithm>

namespace absenc::encolink {

namespace {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

constexpr std::string_view part_text = "MB080SLA20MENT00";  // 16 characters; [8..9] hold the resolution

}  // namespace

VirtualEncoder::VirtualEncoder(const Format& format, Wire wire, const Shaft& shaft, const Build& build)
    : format_(format), wire_(wire), shaft_(&shaft), build_(build) {
  if (format_.resolution == 0) format_.resolution = virtual_format.resolution;
  if (format_.multiturn_bits < 0) format_.multiturn_bits = virtual_format.multiturn_bits;
}

// ---- The line

ByteStep VirtualEncoder::next(Time now) {
  ByteStep step{.at = never};
  update(now);
  if (build_.stream_rate > 0 && power_ != Power::off && !transmitting_ && wire_ == Wire::uart) {
    if (now < next_frame_) return {.at = next_frame_};
    make_frame(now);
    frame_at_ = std::max(now, next_frame_);
    next_frame_ = frame_at_ + Time(1'000'000'000 / build_.stream_rate);
  }
  if (frame_pending_) {
    frame_pending_ = false;
    step.kind = ByteStep::Kind::transfer;
    step.out = frame_;
    step.at = frame_at_;
    return step;
  }
  if (!request_.empty()) step.gap = request_gap;
  step.expect = request_bytes - request_.size();
  return step;
}

void VirtualEncoder::feed(const ByteEvent& event) {
  switch (event.kind) {
    case ByteEvent::Kind::received:
      if (wire_ == Wire::uart) {
        for (const std::uint8_t byte : event.items) byte_received(byte, event.at);
      } else if (power_ != Power::off && event.items.size() >= request_bytes) {
        handle(event.items[0], event.items[1], event.at);
      }
      break;
    case ByteEvent::Kind::selected:
      selected(event.at);
      break;
    case ByteEvent::Kind::sent:
      transmitting_ = false;
      if (wire_ == Wire::spi) stopped_clocking(event);
      break;
    case ByteEvent::Kind::silence:
    case ByteEvent::Kind::line_error:
      request_.clear();
      break;
    default:
      break;
  }
}

void VirtualEncoder::byte_received(std::uint8_t byte, Time at) {
  update(at);
  if (power_ == Power::off || build_.stream_rate > 0) return;
  if (transmitting_) {
    if (interruption_.begins_request(request_bytes, at, uart_settings.character()))
      violate("request before the reply was complete", at);
    return;
  }
  request_.push_back(byte);
  if (request_.size() < request_bytes) return;
  const std::uint8_t config = request_[0];
  const std::uint8_t ra = request_[1];
  request_.clear();
  make_frame(at);
  // Whoever asks with the vendor's library reads as many bytes as the identity may have, twice.
  const bool identifies = frame_.size() == identity_bytes || config == static_cast<std::uint8_t>(Config::identify);
  while (identifies && frame_.size() < build_.identity_size && build_.identity_size > identity_bytes)
    frame_.push_back(0);
  frame_at_ = at + answer_time;
  handle(config, ra, at);
}

void VirtualEncoder::selected(Time at) {
  update(at);
  if (was_selected_ && at - pause_since_ < spi_pause) violate("NCS high for less than 5 us", at);
  was_selected_ = true;
  if (power_ == Power::off) return;
  make_frame(at);
  frame_at_ = at;
}

void VirtualEncoder::stopped_clocking(const ByteEvent& event) {
  pause_since_ = event.at;
  if (event.bits > 0 && event.lead < spi_lead) violate("clock less than 5 us after NCS went low", event.at);
  if (event.width > Time{} && event.width < shortest_clock) violate("clock faster than 4 MHz", event.at);
}

void VirtualEncoder::make_frame(Time now) {
  frame_pending_ = transmitting_ = true;
  interruption_.begin();
  ++answered_;
  if (power_ == Power::starting) {
    frame_ = encode_position(format_, {});
  } else if (identity_next_) {
    frame_ = encode_identity(identity());
    identity_next_ = false;
  } else {
    Position position = measure(now);
    position.channel2 = next_channel2(position, now);
    frame_ = encode_position(format_, position);
  }
}

Identity VirtualEncoder::identity() const {
  Identity identity{.protocol_version = build_.protocol_version,
                    .frame_bytes = static_cast<std::uint8_t>(format_.turns_bytes() != 0 ? 7 : 5),
                    .resolution = format_.resolution};
  std::copy(part_text.begin(), part_text.end(), identity.text.begin() + 2);
  return identity;
}

// The frame that goes out with this request was made before: what it asks for shows in the next one.
void VirtualEncoder::handle(std::uint8_t config, std::uint8_t ra, Time at) {
  if (power_ != Power::on) return;
  switch (static_cast<Config>(config)) {
    case Config::reset_channels:
      return reset_channels();
    case Config::identify:
      identity_next_ = true;
      return reset_channels();
    default:
      return ra_received(ra, at);
  }
}

void VirtualEncoder::violate(std::string_view rule, Time at) {
  violations_.push_back({rule, at});
  ++violation_count_;
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
    cycle_content_ = {position, alarms_, 0};
    if (build_.channel2_disagrees) cycle_content_.position.singleturn ^= 1;
  }
  if (cycle_index_ == size - 2) cycle_content_.channel3 = next_channel3(now);
  if (cycle_index_ == 0 || cycle_index_ == size - 2) cycle_ = encode_cycle(format_, cycle_content_);
  const std::uint8_t byte = cycle_[cycle_index_];
  cycle_index_ = (cycle_index_ + 1) % size;
  return byte;
}

std::uint8_t VirtualEncoder::next_channel3(Time now) {
  if (answered_bytes_ == answer_.size()) return channel3::idle;
  if (now < busy_until_ || build_.busy_for_ever) return channel3::busy;
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
  const auto offset = static_cast<std::int32_t>(build_.offset.fraction(format_.resolution, settings_.offset));
  const std::int64_t position = shaft_->at(now).position;
  return build_.offset.sign == OffsetSign::add ? position + offset : position - offset;
}

Position VirtualEncoder::measure(Time now) const {
  const std::int64_t here = place(now);
  const auto turns = static_cast<std::uint32_t>(here >> 32) - settings_.turns;
  Position position;
  position.singleturn = static_cast<std::uint32_t>(here) >> (32 - format_.resolution);
  position.multiturn = static_cast<std::uint16_t>(turns & low_mask(static_cast<unsigned>(format_.multiturn_bits)));
  position.error = (alarms_ & status::errors) != 0;
  position.warning = (alarms_ & status::warnings) != 0;
  return position;
}

// Brings everything that changes with time up to now.
void VirtualEncoder::update(Time now) {
  if (power_ == Power::starting && now >= ready_at_) power_ = Power::on;
  if (power_ != Power::on) return;
  if (save_pending_ && now >= busy_until_) {
    save_pending_ = false;
    store();
  }
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
  if (power_ != Power::off) return;
  load();
  power_ = Power::starting;
  ready_at_ = kind == PowerOn::real ? now + start_up : now;
  next_frame_ = now;
  busy_until_ = Time{};
  calibration_status_ = 0;
  reset_channels();
  update(now);
}

void VirtualEncoder::power_off(Time now) {
  if (power_ == Power::off) return;
  update(now);
  power_ = Power::off;
  save_pending_ = calibrating_ = identity_next_ = false;
  request_.clear();
  frame_pending_ = transmitting_ = false;
}

}  // namespace absenc::encolink
