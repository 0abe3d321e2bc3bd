// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/device.hpp"

#include <algorithm>

namespace absenc::encolink {

namespace {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

constexpr Time access_time = 200us;  // until an access is executed; assumed
constexpr std::string_view serial_text = "AK2A0001";
constexpr std::string_view part_text = "MB080SLA20MENT00";       // 16 characters; [8..9] hold the resolution
constexpr std::string_view order_text = "MB080SLA20MENT00 SIM";  // 20 characters
constexpr std::uint64_t firmware_major_value = 1;
constexpr std::uint64_t firmware_minor_value = 4;

Identity identity_of(const Format& format) {
  Identity identity{.protocol_version = 2,
                    .frame_bytes = static_cast<std::uint8_t>(format.turns_bytes() != 0 ? 7 : 5),
                    .resolution = format.resolution};
  std::copy(part_text.begin(), part_text.end(), identity.text.begin() + 2);
  return identity;
}

ByteBuffer<20> text_value(std::string_view text) {
  ByteBuffer<20> bytes;
  for (const char c : text) bytes.push_back(static_cast<std::uint8_t>(c));
  return bytes;
}

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
  if (event.width > Time{} && event.width < shortest_clock) violate("clock faster than 4 MHz", event.at);
}

void VirtualEncoder::make_frame(Time now) {
  frame_pending_ = transmitting_ = true;
  interruption_.begin();
  ++answered_;
  if (power_ == Power::starting) {
    frame_ = encode_position(format_, {});
  } else if (identity_next_) {
    frame_ = encode_identity(identity_of(format_));
    identity_next_ = false;
  } else {
    Position position = measure(now);
    position.channel2 = next_channel2(position, now);
    frame_ = encode_position(format_, position);
  }
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

void VirtualEncoder::execute(Time at) {
  const Result<RegisterRequest> request = decode_access(access_);
  const bool writes = access_[access_keys.size()] == static_cast<std::uint8_t>(RegisterRequest::Operation::write);
  access_.clear();
  answer_.clear();
  answered_bytes_ = 0;
  answer_.push_back(writes ? channel3::write_ready : channel3::read_ready);
  busy_until_ = std::max(busy_until_, at + access_time);
  if (request.error() == Error::unsupported) {
    answer_.clear();  // no operation of this number: it stays idle
  } else if (request.error() == Error::wrong_length) {
    answer_.push_back(static_cast<std::uint8_t>(AccessStatus::byte_count));
  } else if (!request) {
    answer_.push_back(static_cast<std::uint8_t>(writes ? AccessStatus::write_checksum : AccessStatus::read_checksum));
  } else if (writes) {
    execute_write(*request, at);
  } else {
    execute_read(*request, at);
  }
}

void VirtualEncoder::execute_read(const RegisterRequest& request, Time at) {
  const Register* found = find_register(request.address);
  AccessStatus status = AccessStatus::ok;
  if (found == nullptr) {
    status = AccessStatus::no_such_register;
  } else if (found->size != request.length) {
    status = AccessStatus::byte_count;
  } else if (found->access == Access::write_only) {
    status = AccessStatus::denied;
  }
  answer_.push_back(static_cast<std::uint8_t>(status));
  if (status == AccessStatus::ok) {
    answer_.append(value_of(static_cast<std::size_t>(found - registers.data()), at));
  } else {  // the vendor's host takes the bytes it asked for whatever the status says
    for (std::size_t i = 0; i < std::min<std::size_t>(request.length, access_capacity); ++i) answer_.push_back(0);
  }
}

void VirtualEncoder::execute_write(const RegisterRequest& request, Time at) {
  const Register* found = find_register(request.address);
  AccessStatus status = AccessStatus::no_such_register;
  if (found != nullptr) {
    const auto index = static_cast<std::size_t>(found - registers.data());
    if (found->access == Access::read_only) {
      status = AccessStatus::denied;
    } else if (found->size != request.length) {
      status = AccessStatus::byte_count;
    } else if (settings_.lock != 0 && index != write_lock) {
      status = AccessStatus::locked;
    } else {
      status = write(index, load_big_endian(request.data), at);
    }
  }
  answer_.push_back(static_cast<std::uint8_t>(status));
}

AccessStatus VirtualEncoder::write(std::size_t index, std::uint64_t value, Time at) {
  switch (index) {
    case position_offset:
      settings_.offset = static_cast<std::uint32_t>(value);
      return AccessStatus::ok;
    case multiturn_preset:
      if (value > low_mask(static_cast<unsigned>(format_.multiturn_bits))) return AccessStatus::out_of_range;
      settings_.preset = static_cast<std::uint32_t>(value);
      settings_.turns = static_cast<std::uint32_t>(static_cast<std::uint64_t>(place(at) >> 32) - value);
      return AccessStatus::ok;
    case write_lock:
      if (value > 1) return AccessStatus::out_of_range;
      settings_.lock = static_cast<std::uint8_t>(value);
      return AccessStatus::ok;
    default:
      return obey(static_cast<std::uint8_t>(value), at);
  }
}

AccessStatus VirtualEncoder::obey(std::uint8_t command, Time at) {
  switch (command) {
    case commands::save:
      save_pending_ = true;
      busy_until_ = at + save_time;
      return AccessStatus::ok;
    case commands::reset:
      settings_ = {};
      return AccessStatus::ok;
    case commands::self_calibrate:
      calibrating_ = true;
      calibrated_at_ = at + calibration_time;
      calibrated_from_ = shaft_->at(at).position;
      calibration_status_ &= calibration::count;
      return AccessStatus::ok;
    default:
      return AccessStatus::out_of_range;
  }
}

ByteBuffer<20> VirtualEncoder::value_of(std::size_t index, Time at) const {
  std::uint64_t value = 0;
  switch (index) {
    case position_offset:
      value = settings_.offset;
      break;
    case multiturn_preset:
      value = settings_.preset;
      break;
    case write_lock:
      value = settings_.lock;
      break;
    case firmware_major:
      value = firmware_major_value;
      break;
    case firmware_minor:
      value = firmware_minor_value;
      break;
    case protocol_register:
      value = identity_of(format_).protocol_version;
      break;
    case temperature:
      value = static_cast<std::uint64_t>(build_.temperature);
      break;
    case speed:
      value = static_cast<std::uint64_t>(std::int64_t{shaft_->at(at).speed_millirpm} / 100);
      break;
    case calibration_status:
      value = calibration_status_;
      break;
    case serial_number:
      return text_value(serial_text);
    default:
      return text_value(order_text);
  }
  std::array<std::uint8_t, 8> bytes{};
  store_big_endian(bytes, value);
  ByteBuffer<20> result;
  result.append(Bytes(bytes).last(registers[index].size));
  return result;
}

// ---- State

// Of the shaft with the offset, as if the turn counter had no end: 2^-32 revolution.
std::int64_t VirtualEncoder::place(Time now) const {
  const auto offset = static_cast<std::int32_t>(settings_.offset);
  const std::int64_t position = shaft_->at(now).position;
  return build_.offset_sign == OffsetSign::add ? position + offset : position - offset;
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

void VirtualEncoder::load() {
  const Bytes bytes = memory_;
  settings_.offset = static_cast<std::uint32_t>(load_big_endian(bytes.first(4)));
  settings_.preset = static_cast<std::uint32_t>(load_big_endian(bytes.subspan(4, 4)));
  settings_.lock = bytes[8];
  settings_.turns = static_cast<std::uint32_t>(load_big_endian(bytes.subspan(9, 4)));
}

void VirtualEncoder::store() {
  const MutableBytes bytes = memory_;
  store_big_endian(bytes.first(4), settings_.offset);
  store_big_endian(bytes.subspan(4, 4), settings_.preset);
  bytes[8] = settings_.lock;
  store_big_endian(bytes.subspan(9, 4), settings_.turns);
  ++memory_version_;
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
