// SPDX-License-Identifier: Apache-2.0
// A virtual Smart-Abs encoder (T-format, paragraphs 6 to 10 of the specification).
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/author/paged_memory.hpp"
#include "absenc/protocol/tformat/frame.hpp"

namespace absenc::tformat {

/// Indexes of the virtual encoder's conditions, in the order of `conditions`.
enum ConditionIndex : std::size_t { battery_voltage, temperature };
/// Conditions of the virtual encoder's environment that users can set.
inline constexpr std::array<Condition, 2> conditions{{
    {"battery", "mV", "voltage of the external battery; 0: there is none, as always with battery=false", 0, 4750, 3600},
    {"temperature", "degC", "of the board", -20, 127, 35},
}};

/// Properties of the virtual encoder's paged memory.
inline constexpr author::PagedMemory paged_memory{
    .areas = memory_areas,
    .select_address = page_select_address,
    .start_page = 0,
    .page_time = memory_time,
    .write_time = memory_time,
    .page_rule = "memory access before the page is ready",
    .write_rule = "memory written while the encoder writes",
    .refused_rule = "what was refused as busy was not asked for again",
};

/// A virtual Smart-Abs encoder with its alarms, EEPROM, battery and temperature.
class VirtualEncoder final : public author::PagedMemoryDevice {
 public:
  /// Constructs an encoder that is off until `power_on`. `shaft` must outlive it.
  VirtualEncoder(const Format& format, const Shaft& shaft)
      : PagedMemoryDevice(Protocol::device_times(format), paged_memory), format_(format), shaft_(&shaft) {
    if (format_.encoder_id < 0) format_.encoder_id = 0x11;
    for (std::size_t i = 0; i < conditions.size(); ++i) conditions_[i] = conditions[i].normal;
    memory_[threshold_at] = overheat_at_shipping;
    watch_battery();
  }
  [[nodiscard]] MutableBytes memory() override { return memory_; }

  /// Returns the number of EEPROM writes so far. The document permits 100 000 writes in total (6.1.1).
  [[nodiscard]] std::uint32_t writes() const { return writes_; }
  void raise_alarms(std::uint32_t bits) override {
    latches_ |= static_cast<std::uint8_t>(bits & (alarms::latched | alarms::counting_error));
    forced_ |= static_cast<std::uint8_t>(bits & (alarms::full_absolute_status | alarms::battery_alarm));
  }
  /// Ends those of the alarms `bits` that `raise_alarms` raised or that are latched.
  void lower_alarms(std::uint32_t bits) override {
    latches_ &= static_cast<std::uint8_t>(~bits);
    forced_ &= static_cast<std::uint8_t>(~bits);
  }
  void set_condition(std::size_t index, std::int64_t value, Time now) override {
    if (is_on(now)) update(now);
    conditions_[index] = value;
    if (is_on(now)) update(now);
    if (off_) watch_battery();
  }
  /// Returns the reply to data ID 3 at the time `now`. It does not update alarms that depend on time, such as
  /// counter_overflow.
  [[nodiscard]] Reply everything(Time now) const {
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
  /// Switches the encoder on at `now`; without effect if it is on.
  void power_on(Time now, PowerOn kind) override {
    if (!off_) return;
    off_ = false;
    if (off_since_) {
      count_on_battery(*off_since_, now);
    } else {
      counter_lap_ = lap(now);
    }
    // If the battery failed while the power was off, the encoder did not count turns (6.5).
    if (battery_lost_) {
      latches_ = static_cast<std::uint8_t>((latches_ & alarms::over_heat) | alarms::battery_error);
      set_turns(0, now);
    }
    battery_lost_ = false;
    restart_memory();
    Responder::power_on(now, kind);
    if (!has_battery() && kind == PowerOn::real) restart(now + start_up_without_battery);
  }
  /// Switches the encoder off at `now`; without effect if it is off.
  void power_off(Time now) override {
    if (off_) return;
    if (is_on(now)) update(now);
    Responder::power_off(now);
    off_ = true;
    off_since_ = now;
    watch_battery();
    zero_pending_ = false;
    latches_ &= static_cast<std::uint8_t>(~(alarms::counting_error | alarms::multiturn_error));
    refused_status_ = 0;
    resets_.forget();
  }

 private:
  // Typical voltages in mV at and below which battery_error and battery_alarm are raised (5.4, 6.5).
  static constexpr std::int32_t battery_error_voltage = 2750;
  static constexpr std::int32_t battery_alarm_voltage = 3100;
  // Speed in 1/1000 rpm from which on the shaft raises full_absolute_status when the encoder is switched on (5.4.1).
  static constexpr std::int32_t full_absolute_speed = 100'000;
  // Greatest speed in 1/1000 rpm of a shaft that counts as standing still.
  static constexpr std::int32_t standing_still = 1'000;
  // Greatest speed in 1/1000 rpm that the turn counter follows without power (5.4.2).
  static constexpr std::int32_t power_off_speed = 6'000'000;
  // Accelerations in rad/s^2 that the turn counter follows without power: the first in general, the second during the
  // first seconds (`power_off_timer`) after power off.
  static constexpr std::int32_t power_off_acceleration = 4'000;
  static constexpr std::int32_t power_off_timer_acceleration = 80'000;
  static constexpr Time power_off_timer = 5s;

  static constexpr std::int32_t magnitude(std::int32_t value) { return value < 0 ? -value : value; }

  // The stored memory ends with the zero position (4 bytes, little endian).
  static constexpr std::size_t threshold_at =
      author::offset_of(memory_areas, service_page, overheat_address, is_stored);
  static constexpr std::size_t zero_at = stored_bytes;
  static constexpr std::size_t memory_size = zero_at + 4;

  // ---- Requests

  Answer respond(Bytes bytes, Time at, ByteBuffer<64>& reply) override {
    update(at);
    const Result<Request> request = decode_request(bytes);
    const std::optional<Reply> made = request ? answer(*request, at) : std::nullopt;
    if (!made) return Answer::refused;
    reply.append(encode_reply(*made).view());
    return Answer::sent;
  }
  // Returns whether a flawed request gets a refusal, and notes the communication alarms that the refusal reports.
  bool is_refused(Flaw flaw, Bytes heard) override {
    if (flaw == Flaw::unknown && !has_sync_code(heard[0])) return false;
    if (flaw == Flaw::unknown && heard[0] != control_field(heard[0] >> 3)) refused_status_ |= status::parity_error;
    if (flaw == Flaw::damaged) refused_status_ |= status::delimiter_error;
    return true;
  }
  void refuse(Time at, ByteBuffer<64>& reply) override {
    update(at);
    resets_.forget();
    Reply refusal = everything(at);
    refusal.status |= refused_status_;
    refused_status_ = 0;
    reply.append(encode_reply(refusal).view());
  }
  std::optional<Reply> answer(const Request& request, Time at) {
    if (!is_reset(request.id)) resets_.end();
    if (is_memory_access(request.id)) return access_memory(request, at);
    Reply reply = everything(at);
    // the reply has more values than its data ID carries; encode_reply puts only those of the data ID into the frame
    reply.id = request.id;
    if (is_reset(request.id)) count_reset(request.id, at);  // the tenth reply of a reset still shows the old alarms
    return reply;
  }

  // ---- Memory

  std::optional<Reply> access_memory(const Request& request, Time at) {
    const Access wanted{request.id == DataId::write_memory, request.address, request.value};
    const std::optional<MemoryAnswer> answer = access(wanted, at, at);
    if (!answer) return std::nullopt;
    return Reply{.id = request.id, .address = request.address, .busy = answer->busy, .value = answer->value};
  }
  [[nodiscard]] std::uint8_t& stored(std::uint8_t page, std::uint8_t address) {
    return memory_[author::offset_of(memory_areas, page, address, is_stored)];
  }
  [[nodiscard]] std::uint8_t load(std::uint8_t page, std::uint8_t address) override {
    const bool measured = page == service_page && address == temperature_address;
    return measured ? static_cast<std::uint8_t>(conditions_[temperature]) : stored(page, address);
  }
  void store(std::uint8_t page, std::uint8_t address, std::uint8_t value) override {
    stored(page, address) = value;
    changed_memory();
  }
  void changed_memory() {
    change_memory();
    ++writes_;
  }

  // ---- Resets

  void count_reset(DataId id, Time at) {
    if (!resets_.count(static_cast<unsigned>(id), at, at)) return;
    const bool stands = magnitude(shaft_->at(at).speed_millirpm) <= standing_still;
    if (expect(stands, "reset while the shaft turns", at)) execute_reset(id, at);
  }
  void execute_reset(DataId id, Time at) {
    if (id == DataId::zero) {
      zero_pending_ = true;
      zero_request_ = counts(at) + zero();
      zero_turns_ = turns(at);
      write_lasts(at + memory_time);
      return;
    }
    latches_ = 0;
    if (id == DataId::reset_multiturn) set_turns(0, at);
  }

  // ---- State

  [[nodiscard]] std::uint32_t zero() const {
    return static_cast<std::uint32_t>(load_little_endian(Bytes(memory_).subspan(zero_at, 4)));
  }
  // Returns the angle of the shaft in counts, over all turns, from the zero that the host has set.
  [[nodiscard]] std::int64_t counts(Time now) const {
    return (shaft_->at(now).position >> (32 - format_.singleturn_bits)) - zero();
  }
  // Returns the number of turns as if the turn counter had no end.
  [[nodiscard]] std::int64_t turns(Time now) const { return (counts(now) >> format_.singleturn_bits) - turn_offset_; }
  [[nodiscard]] bool counts_turns() const { return format_.multiturn_bits != 0; }
  // Returns how often the turn counter has overflowed.
  [[nodiscard]] std::int64_t lap(Time now) const { return turns(now) >> format_.multiturn_bits; }
  void set_turns(std::int64_t turns, Time now) {
    turn_offset_ = (counts(now) >> format_.singleturn_bits) - turns;
    counter_lap_ = 0;
  }
  [[nodiscard]] std::uint8_t alarms_now() const {
    unsigned bits = latches_ | forced_;
    if (full_absolute_) bits |= alarms::full_absolute_status;
    if (battery_now() <= battery_alarm_voltage) bits |= alarms::battery_alarm;
    return static_cast<std::uint8_t>(bits);
  }
  void update(Time now) {
    if (zero_pending_ && now >= written_at()) write_zero();
    if (magnitude(shaft_->at(now).speed_millirpm) < full_absolute_speed) full_absolute_ = false;

    // This function reads the turn counter only when it is called: it does not detect an overflow if the counter turns
    // back before the next call.
    const std::int64_t lap_now = lap(now);
    if (lap_now != counter_lap_ && counts_turns()) latches_ |= alarms::counter_overflow;
    counter_lap_ = lap_now;

    const std::uint8_t threshold = memory_[threshold_at];
    if ((threshold & 0x80) != 0 && conditions_[temperature] > (threshold & 0x7F)) latches_ |= alarms::over_heat;
  }
  // Stores the zero position that a reset has requested; the turns stay.
  void write_zero() {
    zero_pending_ = false;
    const std::uint64_t zeroed = static_cast<std::uint64_t>(zero_request_) & low_mask(format_.singleturn_bits);
    store_little_endian(MutableBytes(memory_).subspan(zero_at, 4), zeroed);
    changed_memory();
    turn_offset_ = ((zero_request_ - zero()) >> format_.singleturn_bits) - zero_turns_;
  }

  // ---- Power

  [[nodiscard]] std::int64_t battery_now() const { return format_.battery ? conditions_[battery_voltage] : 0; }
  [[nodiscard]] bool has_battery() const { return battery_now() > battery_error_voltage; }
  // If the battery fails while the power is off, even for a short time, the encoder reports it after power on (6.5).
  void watch_battery() { battery_lost_ = battery_lost_ || !has_battery(); }

  void started(Time at) override { full_absolute_ = magnitude(shaft_->at(at).speed_millirpm) >= full_absolute_speed; }
  // Raises over_speed if the shaft exceeded a limit of speed or acceleration at a sampled time while the power was off
  // (5.4.2).
  void count_on_battery(Time from, Time now) {
    if (!counts_turns()) return;
    const Time step = std::max(Time(10ms), (now - from) / 10'000);
    for (Time at = from; at < now; at += step) {
      const ShaftState state = shaft_->at(at);
      const std::int32_t limit = at - from < power_off_timer ? power_off_timer_acceleration : power_off_acceleration;
      if (magnitude(state.speed_millirpm) <= power_off_speed && magnitude(state.acceleration) <= limit) continue;
      latches_ |= alarms::over_speed;
      // over_speed means that the turns are wrong, so the virtual encoder makes its counter miss one turn
      ++turn_offset_;
      return;
    }
  }

  [[nodiscard]] std::size_t request_size(Bytes begin) const override { return Protocol::request_size(format_, begin); }
  [[nodiscard]] std::size_t others_reply_size(Bytes) const override { return 0; }

  Format format_;
  const Shaft* shaft_;
  std::array<std::int64_t, conditions.size()> conditions_{};
  std::array<std::uint8_t, memory_size> memory_{};
  std::uint32_t writes_ = 0;

  std::optional<Time> off_since_{};  // time of the last power off; empty before the first one
  bool off_ = true;
  bool battery_lost_ = false;  // whether the battery has failed since power off

  std::int64_t turn_offset_ = 0;  // number that is subtracted from the turns of the shaft
  std::int64_t counter_lap_ = 0;  // number of overflows of the turn counter until the last update
  std::uint8_t latches_ = 0;
  std::uint8_t forced_ = 0;  // alarms that are not latched and that `raise_alarms` raised
  bool full_absolute_ = false;

  bool zero_pending_ = false;
  std::int64_t zero_request_ = 0;  // angle in counts that becomes the zero when the EEPROM is written
  // number of turns that the encoder must report unchanged after the zero was written to the EEPROM
  std::int64_t zero_turns_ = 0;

  author::RowCounter resets_{reset_row, rules()};
  std::uint8_t refused_status_ = 0;
};

}  // namespace absenc::tformat
