// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/tformat/device.hpp"

#include <algorithm>

namespace absenc::tformat {

namespace {

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

VirtualEncoder::VirtualEncoder(const Format& format, const Shaft& shaft)
    : Responder(Protocol::device_times(format)), format_(format), shaft_(&shaft) {
  if (format_.encoder_id < 0) format_.encoder_id = 0x11;
  for (std::size_t i = 0; i < conditions.size(); ++i) conditions_[i] = conditions[i].normal;
  memory_[threshold_at] = overheat_at_shipping;
}

// ---- Requests

VirtualEncoder::Answer VirtualEncoder::respond(Bytes bytes, Time at, ByteBuffer<64>& reply) {
  update(at);
  const Result<Request> request = decode_request(bytes);
  const std::optional<Reply> made = request ? answer(*request, at) : std::nullopt;
  if (!made) return Answer::refused;
  reply.append(encode_reply(*made).view());
  return Answer::sent;
}

// It looks for the next start where there is none (8.1); where the frame ends is not known otherwise: a missing start
// bit tells (8.2, 9.2).
bool VirtualEncoder::is_refused(Flaw flaw, Bytes heard) {
  if (flaw == Flaw::unknown && !has_sync_code(heard[0])) return false;
  if (flaw == Flaw::unknown && heard[0] != control_field(heard[0] >> 3)) refused_status_ |= status::parity_error;
  if (flaw == Flaw::damaged) refused_status_ |= status::delimiter_error;
  return true;
}

void VirtualEncoder::refuse(Time at, ByteBuffer<64>& reply) {
  update(at);
  reset_count_ = 0;
  Reply refusal = everything(at);
  refusal.status |= refused_status_;
  refused_status_ = 0;
  reply.append(encode_reply(refusal).view());
}

std::optional<Reply> VirtualEncoder::answer(const Request& request, Time at) {
  if (!is_reset(request.id)) reset_count_ = 0;
  if (is_memory_access(request.id)) return access_memory(request, at);
  Reply reply = everything(at);
  reply.id = request.id;                                  // encoding takes what this id carries
  if (is_reset(request.id)) count_reset(request.id, at);  // the tenth still shows the old errors
  return reply;
}

// ---- Memory

std::optional<Reply> VirtualEncoder::access_memory(const Request& request, Time at) {
  Reply reply{.id = request.id, .address = request.address, .value = request.value};
  if (at < busy_until_) {
    if (page_changing_) violate("memory access before the page is ready", at);
    reply.busy = true;
    reply.value = 0;
    return reply;
  }
  const bool writing = request.id == DataId::write_memory;
  const bool of_page = request.address == page_select_address;
  const bool measured = page_ == service_page && request.address == temperature_address;
  const bool open =
      of_page ? !writing || is_page(request.value) : is_open(page_, request.address) && !(writing && measured);
  if (!open) return std::nullopt;
  if (writing) {
    busy_until_ = at + memory_time;
    page_changing_ = of_page;
    write(request.address, request.value);
  } else {
    reply.value = value_at(request.address);
  }
  return reply;
}

std::uint8_t VirtualEncoder::value_at(std::uint8_t address) const {
  if (address == page_select_address) return page_;
  if (page_ != service_page) return memory_[std::size_t{page_} * page_addresses + address];
  return address == overheat_address ? memory_[threshold_at] : static_cast<std::uint8_t>(conditions_[temperature]);
}

void VirtualEncoder::write(std::uint8_t address, std::uint8_t value) {
  if (address == page_select_address) {
    page_ = value;
    return;
  }
  memory_[page_ == service_page ? threshold_at : std::size_t{page_} * page_addresses + address] = value;
  changed_memory();
}

void VirtualEncoder::changed_memory() {
  change_memory();
  ++writes_;
}

// ---- Resets

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
  if (magnitude(shaft_->at(at).speed_millirpm) > standing_still) return violate("reset while the shaft turns", at);
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

void VirtualEncoder::set_turns(std::int64_t turns, Time now) {
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

void VirtualEncoder::set_condition(std::size_t index, std::int64_t value, Time now) {
  if (is_on(now)) update(now);
  conditions_[index] = value;
  if (is_on(now)) update(now);
}

std::uint8_t VirtualEncoder::alarms_now() const {
  unsigned bits = latches_ | forced_;
  if (full_absolute_) bits |= alarms::full_absolute_status;
  if (conditions_[battery_voltage] < battery_alarm_below) bits |= alarms::battery_alarm;
  return static_cast<std::uint8_t>(bits);
}

// Brings everything that changes with time up to now.
void VirtualEncoder::update(Time now) {
  if (zero_pending_ && now >= busy_until_) write_zero();
  if (magnitude(shaft_->at(now).speed_millirpm) < full_absolute_speed) full_absolute_ = false;

  // A whole lap between two requests goes unnoticed when it is undone before the next.
  const std::int64_t lap_now = lap(now);
  if (lap_now != counter_lap_) latches_ |= alarms::counter_overflow;
  counter_lap_ = lap_now;

  const std::uint8_t threshold = memory_[threshold_at];
  if ((threshold & 0x80) != 0 && conditions_[temperature] > (threshold & 0x7F)) latches_ |= alarms::over_heat;
}

// The turns stay.
void VirtualEncoder::write_zero() {
  zero_pending_ = false;
  const std::uint64_t zeroed = static_cast<std::uint64_t>(zero_request_) & low_mask(format_.singleturn_bits);
  store_little_endian(MutableBytes(memory_).subspan(zero_at, 4), zeroed);
  changed_memory();
  turn_offset_ = ((zero_request_ - zero()) >> format_.singleturn_bits) - zero_turns_;
}

Reply VirtualEncoder::everything(Time now) const {
  const std::uint64_t mask = low_mask(format_.singleturn_bits);
  const std::uint8_t almc = alarms_now();
  Reply reply{.id = DataId::everything, .status = status_for(almc), .alarms = almc};
  reply.encoder_id = static_cast<std::uint8_t>(format_.encoder_id);
  reply.singleturn = static_cast<std::uint32_t>(static_cast<std::uint64_t>(counts(now)) & mask);
  reply.multiturn =
      static_cast<std::uint32_t>(static_cast<std::uint64_t>(turns(now)) & low_mask(format_.multiturn_bits));
  if ((almc & alarms::full_absolute_status) != 0 && format_.singleturn_bits > full_absolute_bits) {
    reply.singleturn &= ~static_cast<std::uint32_t>(low_mask(format_.singleturn_bits - full_absolute_bits));
  }
  return reply;
}

// ---- Power

void VirtualEncoder::power_on(Time now, PowerOn kind) {
  if (!off_) return;
  off_ = false;
  if (off_since_) {
    count_on_battery(*off_since_, now);
  } else {
    counter_lap_ = lap(now);
  }
  const bool battery = conditions_[battery_voltage] >= battery_error_below;
  // Without battery nothing counted the turns. Over_speed and counter_overflow are indefinite then: here, clear.
  if (!battery) {
    latches_ = alarms::battery_error;
    set_turns(0, now);
  }
  page_ = 0;
  busy_until_ = Time{};
  Responder::power_on(now, kind);
  if (!battery && kind == PowerOn::real) restart(now + start_up_without_battery);
}

void VirtualEncoder::started(Time at) {
  full_absolute_ = magnitude(shaft_->at(at).speed_millirpm) >= full_absolute_speed;
}

// What happened to the turns while only the battery counted them (5.4.2): looked at every 10 ms, but at no more than
// 10 000 points of a long pause.
void VirtualEncoder::count_on_battery(Time from, Time now) {
  const Time step = std::max(Time(10ms), (now - from) / 10'000);
  for (Time at = from; at < now; at += step) {
    const ShaftState state = shaft_->at(at);
    const std::int32_t limit = at - from < power_off_timer ? power_off_timer_acceleration : power_off_acceleration;
    if (magnitude(state.speed_millirpm) <= power_off_speed && magnitude(state.acceleration) <= limit) continue;
    latches_ |= alarms::over_speed;
    ++turn_offset_;  // a turn was missed: the flag means that the count is wrong
    return;
  }
}

void VirtualEncoder::power_off(Time now) {
  if (off_) return;
  if (is_on(now)) update(now);
  Responder::power_off(now);
  off_ = true;
  off_since_ = now;
  zero_pending_ = false;
  latches_ &= static_cast<std::uint8_t>(~(alarms::counting_error | alarms::multiturn_error));
  refused_status_ = 0;
  reset_count_ = 0;
}

}  // namespace absenc::tformat
