// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/device.hpp"

namespace absenc::esl {

namespace {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

constexpr std::int32_t overspeed_above = 10'000'000;  // 1/1000 rpm (Table 8)
constexpr std::int32_t under_voltage_below = 2900;    // mV, typical
constexpr std::int32_t over_voltage_above = 3700;
constexpr std::int32_t standing_still = 1'000;  // 1/1000 rpm: what a servo at rest may tremble
constexpr Time reset_interval_least = 35us;     // "typical 40 us": what is surely too fast

constexpr std::int32_t magnitude(std::int32_t value) { return value < 0 ? -value : value; }
constexpr std::uint32_t counts_of(std::int64_t position) { return static_cast<std::uint32_t>(position) >> 8; }

}  // namespace

VirtualEncoder::VirtualEncoder(const Profile& profile, const Shaft& shaft) : profile_(profile), shaft_(&shaft) {}

// ---- The line

ByteStep VirtualEncoder::next(Time) {
  ByteStep step{.at = never};
  if (reply_pending_) {
    reply_pending_ = false;
    step.kind = ByteStep::Kind::transfer;
    step.out = reply_;
    step.at = reply_at_;
    return step;
  }
  step.expect = 1;
  if (ignoring_ || !request_.empty()) {
    step.gap = idle_time;
    if (!ignoring_ && !stop_wrong_) step.expect = request_length(profile_, *data_id(request_[0])) - request_.size();
  }
  if (ignoring_) step.expect = foreign_end_ > heard_ ? static_cast<std::size_t>(foreign_end_ - heard_) : 0;
  return step;
}

void VirtualEncoder::feed(const ByteEvent& event) {
  switch (event.kind) {
    case ByteEvent::Kind::received:
      for (const std::uint8_t byte : event.items) {
        ++heard_;
        byte_received(byte, event.at);
      }
      break;
    case ByteEvent::Kind::sent:
      transmitting_ = false;
      break;
    case ByteEvent::Kind::silence:
      frame_set_ended();
      break;
    case ByteEvent::Kind::line_error:
      heard_at_ = event.at;
      if (!on_ || transmitting_ || ignoring_) break;
      if (request_.empty()) {
        ignore();
      } else {
        stop_wrong_ = true;  // answered when the host has ended
      }
      break;
    default:
      break;
  }
}

void VirtualEncoder::byte_received(std::uint8_t byte, Time at) {
  if (!on_) return;
  update(at);
  if (transmitting_) return interrupted(byte, at);
  heard_at_ = at;
  if (ignoring_ || stop_wrong_) return;
  request_.push_back(byte);
  if (request_.size() == 1 && (address_of(byte) != profile_.address || !data_id(byte))) return ignore_request(byte);
  if (request_.size() == request_length(profile_, *data_id(request_[0]))) request_complete(at);
}

// Of another encoder, which may be absent: behind its last byte any pause is enough.
void VirtualEncoder::ignore_request(std::uint8_t control_field) {
  const auto id = data_id(control_field);
  foreign_end_ = heard_ + (id ? request_length(profile_, *id) - 1 : 0);
  ignore();
}

// A missing start bit ends the frame set: what was cut short is no request.
void VirtualEncoder::frame_set_ended() {
  if (stop_wrong_) report_bad_request(status::stop_error, heard_at_);
  stop_wrong_ = ignoring_ = false;
  request_.clear();
}

void VirtualEncoder::interrupted(std::uint8_t byte, Time at) {
  const auto id = data_id(byte);
  const bool is_request = id && byte == control_field(profile_, address_of(byte), *id);
  const std::size_t length = is_request ? request_length(profile_, *id) : 0;
  if (interruption_.begins_request(length, at, line_settings.character())) {
    violate("something was sent during the encoder's transmission", at);
  }
}

void VirtualEncoder::request_complete(Time at) {
  const Result<Request> request = decode_request(profile_, request_);
  if (request) return answer(*request, at);
  const bool crc_wrong =
      request_.size() > 1 &&
      checksum8(profile_.crc_bit_order, request_.view().first(request_.size() - 1)) != request_[request_.size() - 1];
  if (crc_wrong || request.error() == Error::out_of_range) {
    in_a_row_ = 0;
    return ignore();
  }
  report_bad_request(status::parity_error, at);
}

// Table 5 reports it in SF, the overview wants no answer; a memory reply has no SF. CF is echoed as it came.
void VirtualEncoder::report_bad_request(std::uint8_t status_bit, Time at) {
  in_a_row_ = 0;
  const std::uint8_t field = request_[0];
  const DataId id = *data_id(field);
  if (profile_.bad_request == BadRequest::silent || is_memory_access(id)) return ignore();
  Reply reply = reply_to(id, at);
  reply.one.status |= status_bit;
  reply.two.status |= status_bit;
  send(encode_reply(profile_, reply, field), at);
}

void VirtualEncoder::send(const ReplyBytes& reply, Time at) {
  request_.clear();
  reply_ = reply;
  reply_at_ = at + answer_time;
  reply_pending_ = true;
  transmitting_ = true;
  interruption_.begin();
  ++answered_;
}

void VirtualEncoder::violate(std::string_view rule, Time at) {
  violations_.push_back({rule, at});
  ++violation_count_;
}

// ---- Requests

void VirtualEncoder::answer(const Request& request, Time at) {
  if (is_reset(request.id) && in_a_row_ > 0 && request.id == last_id_ && at - last_reset_ < reset_interval_least) {
    violate("reset sent too fast: much less than 40 us after the one before", at);
    in_a_row_ = 0;
  }
  in_a_row_ = request.id == last_id_ ? in_a_row_ + 1 : 1;
  last_id_ = request.id;
  if (request.id == DataId::encoder_id && in_a_row_ == reset_requests) {
    violate("ID 8 sent eight times in a row: dynamic addressing, which nothing describes", at);
  }
  if (profile_.sequence_step == SequenceStep::request || has_sequence(request.id)) {
    for (std::uint8_t& counter : counters_) ++counter;
  }
  if (is_memory_access(request.id)) return answer_memory(request, at);
  send(encode_reply(profile_, reply_to(request.id, at)), at);
  if (is_reset(request.id)) count_reset(request.id, at);  // after the reply, which still shows the old state
}

void VirtualEncoder::answer_memory(const Request& request, Time at) {
  if (profile_.bus) {
    violate("memory access with several encoders on the line", at);
    return ignore();
  }
  const bool writing = request.id == DataId::write_memory;
  const bool selecting = request.memory_address == page_select_address;
  const MemoryArea* area = find_area(page_, request.memory_address);
  const bool exists = selecting ? !writing || is_page(request.value) : area != nullptr;
  if (!exists) return ignore();  // not said: it is not acknowledged then
  Reply reply{.id = request.id,
              .encoder_address = profile_.address,
              .memory_address = request.memory_address,
              .value = request.value};
  const bool immediate = selecting || area->kind == MemoryArea::Kind::registers;
  if (at < page_ready_at_) {
    violate("memory access before the page is ready", at);
    reply.busy = true;
  } else if (at < busy_until_ && !immediate) {
    reply.busy = true;
  } else if (writing) {
    write_byte(request, reply, at);
  } else {
    read_byte(request, reply, at);
  }
  if (reply.busy) reply.value = 0;
  send(encode_reply(profile_, reply), at);
}

void VirtualEncoder::read_byte(const Request& request, Reply& reply, Time at) {
  const std::uint8_t address = request.memory_address;
  if (address == page_select_address) {
    reply.value = page_;
  } else if (page_ == register_page) {
    reply.value = address == error_info_address ? error_info() : page8_[address];
  } else if (page_ == 14 && address >= 0x20) {
    reply.value = page14_[address - 0x20];
  } else if (byte_pending_ && pending_address_ == address && at - pending_at_ >= eeprom_read_time) {
    byte_pending_ = false;
    reply.value = *stored(page_, address);
  } else {
    if (byte_pending_ && at - pending_at_ < eeprom_read_time) {
      violate("memory read again less than 200 us after the request before", at);
    }
    byte_pending_ = reply.busy = true;
    pending_address_ = address;
    pending_at_ = at;
  }
}

void VirtualEncoder::write_byte(const Request& request, Reply& reply, Time at) {
  const std::uint8_t address = request.memory_address;
  reply.value = request.value;
  byte_pending_ = false;
  if (address == page_select_address) {
    page_ = request.value;
    page_ready_at_ = at + page_time;
  } else if (page_ == register_page) {
    page8_[address] = request.value;
  } else if (page_ == 14 && address >= 0x20) {
    page14_[address - 0x20] = request.value;
  } else {
    *stored(page_, address) = request.value;
    ++memory_version_;
    ++writes_;
    busy_until_ = at + eeprom_write_time;
  }
}

std::uint8_t* VirtualEncoder::stored(std::uint8_t page, std::uint8_t address) {
  const MemoryArea* area = find_area(page, address);
  if (area == nullptr || area->kind == MemoryArea::Kind::registers) return nullptr;
  if (page == 14) return &memory_[mtp_at + address];
  return &memory_[std::size_t{page} * page_size + address];
}

void VirtualEncoder::count_reset(DataId id, Time at) {
  last_reset_ = at;
  if (in_a_row_ < reset_requests) return;
  in_a_row_ = 0;
  if (magnitude(shaft_->at(at).speed_millirpm) > standing_still) return violate("reset while the shaft turns", at);
  execute_reset(id, at);
}

void VirtualEncoder::execute_reset(DataId id, Time at) {
  if (id == DataId::clear_alarms) {
    latches_ &= static_cast<std::uint8_t>(~alarms::xc_error);
    if (turns_cleared_) latches_ &= static_cast<std::uint8_t>(~alarms::multiturn_error);
    return;
  }
  const std::uint16_t turns_before = turns(at);
  if (id == DataId::zero || environment_.d_clears_singleturn) {
    // Each channel takes its own measurement as its zero.
    store_little_endian(MutableBytes(memory_).subspan(zero_at, 4), counts_of(shaft_->at(at).position));
    store_little_endian(MutableBytes(memory_).subspan(zero2_at, 4), counts_of(shaft_->at(at).position));
  }
  if (id == DataId::reset_multiturn) turns_cleared_ = true;
  set_turns(id == DataId::reset_multiturn ? 0 : turns_before, at);
  ++writes_;
  busy_until_ = at + eeprom_write_time;
}

// ---- State

std::uint32_t VirtualEncoder::singleturn_one(Time now) const {
  const ChannelFault& fault = faults_[0];
  if (fault.singleturn) return *fault.singleturn;
  const auto zero = static_cast<std::uint32_t>(load_little_endian(Bytes(memory_).subspan(zero_at, 4)));
  return (counts_of(shaft_->at(now).position) - zero) & 0xFFFFFF;
}

// From its own sight of the shaft and its own zero.
std::uint32_t VirtualEncoder::singleturn_two(Time now) const {
  const ChannelFault& fault = faults_[1];
  const auto zero = static_cast<std::uint32_t>(load_little_endian(Bytes(memory_).subspan(zero2_at, 4)));
  const std::uint32_t counts = fault.singleturn ? *fault.singleturn : counts_of(shaft_->at(now).position) - zero;
  return (counts + (fault.redundant_offset << 15)) & 0xFFFFFF;
}

// Turns change where the zeroed position wraps.
std::int64_t VirtualEncoder::shaft_turns(Time now) const {
  const std::uint64_t zero = load_little_endian(Bytes(memory_).subspan(zero_at, 4));
  return (shaft_->at(now).position - static_cast<std::int64_t>(zero << 8)) >> 32;
}

std::uint16_t VirtualEncoder::turns(Time now) const {
  const std::uint64_t offset = load_little_endian(Bytes(memory_).subspan(turns_at, 8));
  return static_cast<std::uint16_t>(static_cast<std::uint64_t>(shaft_turns(now)) - offset);
}

void VirtualEncoder::set_turns(std::uint16_t turns, Time now) {
  const std::uint64_t offset = static_cast<std::uint64_t>(shaft_turns(now)) - turns;
  store_little_endian(MutableBytes(memory_).subspan(turns_at, 8), offset);
  ++memory_version_;
}

void VirtualEncoder::raise_alarms(std::uint32_t bits) {
  latches_ |= static_cast<std::uint8_t>(bits & ~unsigned{alarms::voltage});
  forced_ |= static_cast<std::uint8_t>(bits & alarms::voltage);
}

void VirtualEncoder::lower_alarms(std::uint32_t bits) {
  latches_ &= static_cast<std::uint8_t>(~bits);
  forced_ &= static_cast<std::uint8_t>(~bits);
}

std::uint8_t VirtualEncoder::alarms_now() const {
  unsigned bits = latches_ | forced_;
  if (environment_.supply_millivolts < under_voltage_below) bits |= alarms::under_voltage;
  if (environment_.supply_millivolts > over_voltage_above) bits |= alarms::over_voltage;
  return static_cast<std::uint8_t>(bits);
}

std::uint8_t VirtualEncoder::error_info() const {
  if ((latches_ & alarms::led_or_lissajous_error) == 0) return 0;
  return lissajous_ ? error_info_lissajous : error_info_led;
}

ChannelReply VirtualEncoder::channel_now(Channel channel, Time now) const {
  const ChannelFault& fault = faults_[static_cast<std::size_t>(channel)];
  const auto alarms = static_cast<std::uint8_t>(alarms_now() | fault.alarms);
  const unsigned led = lissajous_ ? 0u : unsigned{alarms::led_or_lissajous_error};
  const unsigned safety = alarms::singleturn_error | alarms::memory_error | alarms::voltage | led;
  unsigned bits = channel == Channel::two ? status::channel_2 : 0u;
  if ((alarms & safety) != 0) bits |= status::safety_error;
  if ((alarms & ~safety & 0xFF) != 0) bits |= status::non_safety_error;
  if (environment_.temperature > environment_.warning_above) bits |= status::temperature_warning;
  if (ready(now)) bits |= status::ready;
  if (environment_.forced_test_passed) bits |= status::forced_test_passed;
  const std::uint8_t counter = counters_[static_cast<std::size_t>(channel)];
  const std::uint8_t sequence = fault.sequence.value_or(counter);
  return {.status = static_cast<std::uint8_t>((bits | fault.status_set) & ~unsigned{fault.status_clear}),
          .alarms = alarms,
          .sequence = channel == Channel::one ? sequence : static_cast<std::uint8_t>(sequence & 0x7F),
          .encoder_id = 0xD8};
}

Reply VirtualEncoder::reply_to(DataId id, Time now) const {
  Reply reply{.id = id, .encoder_address = profile_.address};
  reply.one = channel_now(Channel::one, now);
  reply.two = channel_now(Channel::two, now);
  reply.singleturn = singleturn_one(now);
  reply.multiturn = turns(now);
  const bool wide = id == DataId::calibration && profile_.id6_rs == Id6Redundant::bits_16;
  reply.redundant = static_cast<std::uint16_t>(singleturn_two(now) >> (wide ? 8 : 15));
  reply.temperature = static_cast<std::uint8_t>(environment_.temperature);
  return reply;
}

void VirtualEncoder::update(Time now) {
  if (magnitude(shaft_->at(now).speed_millirpm) > overspeed_above) latches_ |= alarms::overspeed;
}

// ---- Power

void VirtualEncoder::power_on(Time now, PowerOn kind) {
  if (on_) return;
  on_ = true;
  ready_at_ = kind == PowerOn::real ? now + environment_.start_up : now;
  page_ = register_page;
  page_ready_at_ = busy_until_ = Time{};
  page8_.fill(0);
  page14_.fill(0);
  counters_.fill(0);
}

void VirtualEncoder::power_off(Time) {
  on_ = false;
  latches_ &= alarms::turns_wrong;  // the others need a power cycle; these an ID C
  turns_cleared_ = false;
  byte_pending_ = ignoring_ = stop_wrong_ = reply_pending_ = transmitting_ = false;
  request_.clear();
  in_a_row_ = 0;
}

}  // namespace absenc::esl
