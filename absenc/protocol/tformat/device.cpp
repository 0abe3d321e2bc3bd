// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/tformat/device.hpp"

#include <algorithm>

namespace absenc::tformat {

namespace {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

constexpr std::int32_t battery_error_below = 2750;  // mV, typical (5.4)
constexpr std::int32_t battery_alarm_below = 3100;
constexpr std::int32_t full_absolute_speed = 100'000;   // 1/1000 rpm (5.4.1)
constexpr std::int32_t standing_still = 1'000;          // 1/1000 rpm: what a servo at rest may tremble
constexpr std::int32_t power_off_speed = 6'000'000;     // 1/1000 rpm (5.4.2)
constexpr std::int32_t power_off_acceleration = 4'000;  // rad/s^2
constexpr std::int32_t power_off_timer_acceleration = 80'000;
constexpr Time power_off_timer = 5s;

constexpr std::int32_t magnitude(std::int32_t value) { return value < 0 ? -value : value; }

}  // namespace

VirtualEncoder::VirtualEncoder(const Format& format, const Shaft& shaft) : format_(format), shaft_(&shaft) {
  if (format_.encoder_id < 0) format_.encoder_id = 0x11;
  memory_[threshold_at] = overheat_at_shipping;
}

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
  if (refusing_) {
    step.expect = 1;
    step.gap = line_settings.character();
  } else if (!request_.empty()) {
    step.expect = request_length(*data_id(request_[0])) - request_.size();
    step.gap = line_settings.character();
  } else {
    step.expect = 1;
  }
  return step;
}

void VirtualEncoder::feed(const ByteEvent& event) {
  switch (event.kind) {
    case ByteEvent::Kind::received:
      for (const std::uint8_t byte : event.items) byte_received(byte, event.at);
      break;
    case ByteEvent::Kind::sent:
      transmitting_ = false;
      break;
    case ByteEvent::Kind::silence:  // a missing start bit ends the frame (9.2): it was cut short, or is refused
      if (refusing_ || !request_.empty()) answer_refused(event.at);
      break;
    case ByteEvent::Kind::line_error:
      if (power_ == Power::starting) update(event.at);
      if (power_ != Power::on || transmitting_) break;
      heard_at_ = event.at;
      refuse(status::delimiter_error);
      break;
    default:
      break;
  }
}

void VirtualEncoder::byte_received(std::uint8_t byte, Time at) {
  update(at);
  if (power_ != Power::on) return;
  if (transmitting_) return interrupted(byte, at);
  heard_at_ = at;
  if (refusing_) return;
  if (request_.empty()) {
    if (!has_sync_code(byte)) return;  // no answer: it looks for the next start (8.1)
    if (byte != control_field(byte >> 3)) return refuse(status::parity_error);
    if (!data_id(byte)) return refuse(0);
  }
  request_.push_back(byte);
  if (request_.size() == request_length(*data_id(request_[0]))) request_complete(at);
}

void VirtualEncoder::interrupted(std::uint8_t byte, Time at) {
  const auto id = byte == control_field(byte >> 3) ? data_id(byte) : std::nullopt;
  if (interruption_.begins_request(id ? request_length(*id) : 0, at, line_settings.character())) {
    violate("request during the encoder's transmission", at);
  }
}

void VirtualEncoder::request_complete(Time at) {
  const Result<Request> request = decode_request(request_);
  if (request) {
    answer(*request, at);
  } else {
    refuse(0);
  }
}

void VirtualEncoder::send(const Reply& reply, Time at) {
  request_.clear();
  reply_ = encode_reply(reply);
  reply_at_ = at + answer_time;
  reply_pending_ = true;
  transmitting_ = true;
  interruption_.begin();
  ++answered_;
}

// Where the frame ends is not known yet: a missing start bit tells (8.2, 9.2). Nothing is sent before.
void VirtualEncoder::refuse(std::uint8_t status_bits) {
  request_.clear();
  refusing_ = true;
  refused_status_ |= status_bits;
}

void VirtualEncoder::answer_refused(Time at) {
  reset_count_ = 0;
  Reply reply = everything(at);
  reply.status |= refused_status_;
  refusing_ = false;
  refused_status_ = 0;
  send(reply, heard_at_);
}

void VirtualEncoder::violate(std::string_view rule, Time at) {
  violations_.push_back({rule, at});
  ++violation_count_;
}

// ---- Requests

void VirtualEncoder::answer(const Request& request, Time at) {
  if (!is_reset(request.id)) reset_count_ = 0;
  if (is_memory_access(request.id)) {
    answer_memory(request, at);
  } else {
    answer_data(request, at);
  }
}

void VirtualEncoder::answer_data(const Request& request, Time at) {
  Reply reply = everything(at);
  reply.id = request.id;  // encoding takes what this id carries
  send(reply, at);
  if (is_reset(request.id)) count_reset(request.id, at);  // after the reply: the tenth still shows the old errors
}

void VirtualEncoder::answer_memory(const Request& request, Time at) {
  const bool writing = request.id == DataId::write_memory;
  const bool selecting = request.address == page_select_address;
  Reply reply{.id = request.id, .address = request.address, .value = request.value};
  if (at < busy_until_) {
    if (page_changing_) violate("memory access before the page is ready", at);
    reply.busy = true;
    reply.value = 0;
    return send(reply, at);
  }
  const bool temperature = page_ == service_page && request.address == temperature_address;
  const bool open = selecting ? !writing || request.value < user_pages || request.value == service_page
                              : is_open(page_, request.address) && !(writing && temperature);
  if (!open) return refuse(0);

  const std::size_t index =
      page_ == service_page ? threshold_at : std::size_t{page_} * page_addresses + request.address;
  if (!writing) {
    if (selecting) {
      reply.value = page_;
    } else {
      reply.value = temperature ? static_cast<std::uint8_t>(environment_.temperature) : memory_[index];
    }
  } else {
    busy_until_ = at + memory_time;
    page_changing_ = selecting;
    if (selecting) {
      page_ = request.value;
    } else {
      memory_[index] = request.value;
      ++memory_version_;
      ++writes_;
    }
  }
  send(reply, at);
}

void VirtualEncoder::count_reset(DataId id, Time at) {
  if (reset_count_ > 0 && at - last_reset_ < reset_interval) {
    violate("reset sent too fast: less than 40 us after the one before", at);
    reset_count_ = 0;
  }
  if (id != reset_id_) reset_count_ = 0;
  reset_id_ = id;
  last_reset_ = at;
  if (++reset_count_ < reset_requests) return;
  reset_count_ = 0;
  if (magnitude(shaft_->at(at).speed_millirpm) > standing_still) {
    return violate("reset while the shaft turns", at);
  }
  execute_reset(id, at);
}

void VirtualEncoder::execute_reset(DataId id, Time at) {
  if (id == DataId::zero) {
    zero_pending_ = true;
    zero_request_ = counts(at) + zero();
    zero_turns_ = turns(at);
    busy_until_ = at + memory_time;
    page_changing_ = false;
    return;
  }
  latches_ = 0;
  if (id == DataId::reset_multiturn) set_turns(0, at);
}

// ---- State

std::uint32_t VirtualEncoder::zero() const {
  return static_cast<std::uint32_t>(load_little_endian(Bytes(memory_).subspan(zero_at, 4)));
}

// Counts since the shaft's own zero, the programmed zero taken off.
std::int64_t VirtualEncoder::counts(Time now) const {
  return (shaft_->at(now).position >> (32 - format_.singleturn_bits)) - zero();
}

// As if the turn counter had no end.
std::int64_t VirtualEncoder::turns(Time now) const { return (counts(now) >> format_.singleturn_bits) - turn_offset_; }

// How often the turn counter has gone round.
std::int64_t VirtualEncoder::lap(Time now) const { return turns(now) >> format_.multiturn_bits; }

void VirtualEncoder::set_turns(std::uint32_t turns, Time now) {
  turn_offset_ = (counts(now) >> format_.singleturn_bits) - turns;
  counter_lap_ = 0;
}

void VirtualEncoder::raise_alarms(std::uint32_t bits) {
  latches_ |= static_cast<std::uint8_t>(bits & (alarms::latched | alarms::counting_error));
  forced_ |= static_cast<std::uint8_t>(bits & (alarms::full_absolute_status | alarms::battery_alarm));
}

void VirtualEncoder::lower_alarms(std::uint32_t bits) {
  latches_ &= static_cast<std::uint8_t>(~bits);
  forced_ &= static_cast<std::uint8_t>(~bits);
}

std::uint8_t VirtualEncoder::alarms_now() const {
  unsigned bits = latches_ | forced_;
  if (full_absolute_) bits |= alarms::full_absolute_status;
  if (environment_.battery_millivolts < battery_alarm_below) bits |= alarms::battery_alarm;
  return static_cast<std::uint8_t>(bits);
}

// Brings everything that changes with time up to now.
void VirtualEncoder::update(Time now) {
  if (power_ == Power::off) return;
  if (power_ == Power::starting) {
    if (now < ready_at_) return;
    power_ = Power::on;
    full_absolute_ = magnitude(shaft_->at(ready_at_).speed_millirpm) >= full_absolute_speed;
  }
  if (zero_pending_ && now >= busy_until_) {
    zero_pending_ = false;
    const std::uint64_t zeroed = static_cast<std::uint64_t>(zero_request_) & low_mask(format_.singleturn_bits);
    store_little_endian(MutableBytes(memory_).subspan(zero_at, 4), zeroed);
    ++memory_version_;
    ++writes_;
    turn_offset_ = ((zero_request_ - zero()) >> format_.singleturn_bits) - zero_turns_;  // the turns stay
  }
  if (magnitude(shaft_->at(now).speed_millirpm) < full_absolute_speed) full_absolute_ = false;

  // A whole lap between two requests goes unnoticed when it is undone before the next.
  const std::int64_t lap_now = lap(now);
  if (lap_now != counter_lap_) latches_ |= alarms::counter_overflow;
  counter_lap_ = lap_now;

  const std::uint8_t threshold = memory_[threshold_at];
  if ((threshold & 0x80) != 0 && environment_.temperature > (threshold & 0x7F)) latches_ |= alarms::over_heat;
}

Reply VirtualEncoder::everything(Time now) {
  const std::int64_t position = counts(now);
  const std::uint8_t almc = alarms_now();
  Reply reply{.id = DataId::everything, .status = status_for(almc), .alarms = almc};
  reply.encoder_id = static_cast<std::uint8_t>(format_.encoder_id);
  reply.singleturn =
      static_cast<std::uint32_t>(static_cast<std::uint64_t>(position) & low_mask(format_.singleturn_bits));
  reply.multiturn =
      static_cast<std::uint32_t>(static_cast<std::uint64_t>(turns(now)) & low_mask(format_.multiturn_bits));
  if ((almc & alarms::full_absolute_status) != 0 && format_.singleturn_bits > full_absolute_bits) {
    reply.singleturn &= ~static_cast<std::uint32_t>(low_mask(format_.singleturn_bits - full_absolute_bits));
  }
  return reply;
}

// ---- Power

void VirtualEncoder::power_on(Time now, PowerOn kind) {
  if (power_ != Power::off) return;
  if (was_on_) {
    update_power_off(now);
  } else {
    counter_lap_ = lap(now);
  }
  const bool battery = environment_.battery_millivolts >= battery_error_below;
  // Without battery nothing counted the turns. Over_speed and counter_overflow are indefinite then: here, clear.
  if (!battery) {
    latches_ = alarms::battery_error;
    set_turns(0, now);
  }
  power_ = Power::starting;
  ready_at_ = now;
  if (kind == PowerOn::real) ready_at_ += battery ? start_up_with_battery : start_up_without_battery;
  page_ = 0;
  busy_until_ = Time{};
  update(now);
}

// What happened to the turns while only the battery counted them (5.4.2): looked at every 10 ms, but at no more than
// 10 000 points of a long pause.
void VirtualEncoder::update_power_off(Time now) {
  const Time step = std::max(Time(10ms), (now - off_since_) / 10'000);
  for (Time at = off_since_; at < now; at += step) {
    const ShaftState state = shaft_->at(at);
    const std::int32_t limit =
        at - off_since_ < power_off_timer ? power_off_timer_acceleration : power_off_acceleration;
    if (magnitude(state.speed_millirpm) <= power_off_speed && magnitude(state.acceleration) <= limit) continue;
    latches_ |= alarms::over_speed;
    ++turn_offset_;  // a turn was missed: the flag means that the count is wrong
    return;
  }
}

void VirtualEncoder::power_off(Time now) {
  if (power_ == Power::off) return;
  update(now);
  power_ = Power::off;
  was_on_ = true;
  off_since_ = now;
  zero_pending_ = false;
  latches_ &= static_cast<std::uint8_t>(~(alarms::counting_error | alarms::multiturn_error));
  request_.clear();
  reply_pending_ = transmitting_ = refusing_ = false;
  refused_status_ = 0;
  reset_count_ = 0;
}

}  // namespace absenc::tformat
