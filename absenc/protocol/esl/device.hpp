// SPDX-License-Identifier: Apache-2.0
// A virtual QS35 encoder (ESL) with two channels, which records the rules that its host breaks.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/author/paged_memory.hpp"
#include "absenc/protocol/esl/reply.hpp"

namespace absenc::esl {

/// Indexes of `conditions`. A condition that makes a channel faulty leaves its CRC right.
namespace condition {
/// Indexes of the conditions in the table `conditions`.
enum Index : std::size_t {
  supply_voltage,
  temperature,
  forced_test,
  lissajous,
  id_d_clears_singleturn,
  redundant_offset,
  ch1_stuck,  ///< first condition that each channel has for itself; the condition of channel 2 has the next index
  ch2_stuck,
  ch1_sequence,
  ch2_sequence,
  ch1_alarms,
  ch2_alarms,
  ch1_status_set,
  ch2_status_set,
  ch1_status_clear,
  ch2_status_clear,
};
}  // namespace condition

/// Conditions of the virtual encoder that users can set.
inline constexpr std::array<Condition, 16> conditions{{
    {"supply_voltage", "mV", "as the encoder measures it: alarms below 2900 and above 3700 (Table 8)", 0, 6000, 3300},
    {"temperature", "degC", "inside the encoder; above 105 it warns (assumed: the document gives no limit)", -128, 127,
     35},
    {"forced_test", "", "the forced test has passed", 0, 1, 0},
    {"lissajous", "", "led_or_lissajous_error is the disc's signals, not the LED", 0, 1, 0},
    {"id_d_clears_singleturn", "", "ID D clears the single-turn position too, as the change log of rev 1.4 has it", 0,
     1, 0},
    {"redundant_offset", "", "RS is so many 1/512 turns off", 0, 511, 0},
    {"ch1_stuck", "counts", "ABS stands still here; -1: it follows the shaft", -1, 0xFFFFFF, -1},
    {"ch2_stuck", "counts", "the position behind RS stands still here; -1: it follows the shaft", -1, 0xFFFFFF, -1},
    {"ch1_sequence", "", "SC1 stands still here; -1: it counts", -1, 255, -1},
    {"ch2_sequence", "", "SC2 stands still here; -1: it counts", -1, 255, -1},
    {"ch1_alarms", "", "bits of ALM that channel 1 alone raises", 0, 255, 0},
    {"ch2_alarms", "", "bits of ALM that channel 2 alone raises", 0, 255, 0},
    {"ch1_status_set", "", "bits of SF of channel 1 that are stuck at 1", 0, 255, 0},
    {"ch2_status_set", "", "bits of SF of channel 2 that are stuck at 1", 0, 255, 0},
    {"ch1_status_clear", "", "bits of SF of channel 1 that are stuck at 0", 0, 255, 0},
    {"ch2_status_clear", "", "bits of SF of channel 2 that are stuck at 0", 0, 255, 0},
}};

/// Areas and times of the virtual encoder's paged memory.
inline constexpr author::PagedMemory paged_memory{
    .areas = memory_map,
    .select_address = page_select_address,
    .start_page = register_page,
    .page_time = page_time,
    .write_time = eeprom_write_time,
    .fetch_time = eeprom_read_time,
    .exclusive = false,
    .is_immediate = is_immediate,
    .page_rule = "memory access before the page is ready",
    .write_rule = "memory written less than 6 ms after the write before",
    .fetch_rule = "an EEPROM byte asked for only once",
    .fetch_time_rule = "memory read again less than 200 us after the request before",
};

/// A virtual QS35 encoder with its two channels, alarms, memory and faults.
class VirtualEncoder final : public author::PagedMemoryDevice {
 public:
  /// Constructs an encoder that is off until `power_on`. `shaft` must outlive it.
  VirtualEncoder(const Profile& profile, const Shaft& shaft)
      : PagedMemoryDevice({.character = line_settings.character(), .answer_time = answer_time}, paged_memory),
        profile_(profile),
        shaft_(&shaft) {
    for (std::size_t i = 0; i < conditions.size(); ++i) condition_[i] = static_cast<std::int32_t>(conditions[i].normal);
  }
  [[nodiscard]] MutableBytes memory() override { return memory_; }
  /// Returns the stored memory byte at `address` of `page`; null if Table 11 does not list it.
  [[nodiscard]] std::uint8_t* stored(std::uint8_t page, std::uint8_t address) {
    const MemoryArea* const area = find_area(page, address);
    if (area == nullptr) return nullptr;
    if (is_register(*area)) return &registers_[author::offset_of(memory_map, page, address, is_register)];
    return &memory_[author::offset_of(memory_map, page, address, is_stored)];
  }
  void set_condition(std::size_t index, std::int64_t value, Time) override {
    condition_[index] = static_cast<std::int32_t>(value);
  }
  void raise_alarms(std::uint32_t bits) override {
    // A reset of the turns (data ID D) permits clearing multiturn_error only if the alarm was raised before this reset.
    if ((bits & ~unsigned{latches_} & alarms::multiturn_error) != 0) turns_cleared_ = false;
    latches_ |= static_cast<std::uint8_t>(bits & ~unsigned{alarms::voltage});
    forced_ |= static_cast<std::uint8_t>(bits & alarms::voltage);
  }
  /// Ends the alarms in `bits` that were raised or are latched; an alarm that a condition causes stays raised.
  void lower_alarms(std::uint32_t bits) override {
    latches_ &= static_cast<std::uint8_t>(~bits);
    forced_ &= static_cast<std::uint8_t>(~bits);
  }
  /// Returns the reply to data ID `id` at the time `now`. The reply has the values of both channels, also those that
  /// replies to `id` do not carry.
  [[nodiscard]] Reply reply_to(DataId id, Time now) const {
    Reply reply{.id = id, .encoder_address = profile_.address};
    reply.one = channel_now(Channel::one, now);
    reply.two = channel_now(Channel::two, now);
    reply.singleturn = singleturn(Channel::one, now);
    reply.multiturn = turns(now);
    const bool wide = id == DataId::calibration && profile_.id6_rs == Id6Redundant::bits_16;
    const auto offset = static_cast<std::uint32_t>(value_of(condition::redundant_offset)) << 15;
    const std::uint32_t two = (singleturn(Channel::two, now) + offset) & 0xFFFFFF;
    reply.redundant = static_cast<std::uint16_t>(two >> (wide ? 8 : 15));
    reply.temperature = static_cast<std::int8_t>(value_of(condition::temperature));
    return reply;
  }
  /// Switches the encoder on; with PowerOn::real, the status field (SF) has `ready` only after the start-up time.
  void power_on(Time now, PowerOn kind) override {
    ready_at_ = kind == PowerOn::real ? now + start_up : now;
    Responder::power_on(now, kind);
  }

 private:
  // Speed in 1/1000 rpm above which the alarm overspeed is raised (Table 8).
  static constexpr std::int32_t overspeed_above = 10'000'000;
  // Supply voltage in mV below which the alarm under_voltage is raised.
  static constexpr std::int32_t under_voltage_below = 2900;
  static constexpr std::int32_t over_voltage_above = 3700;
  // Greatest speed in 1/1000 rpm at which the shaft counts as at rest.
  static constexpr std::int32_t standing_still = 1'000;
  // Temperature in degC above which the status field (SF) warns; assumed, because the document states no limit.
  static constexpr std::int32_t warning_above = 105;
  // Time from power on until the status field (SF) has `ready`; assumed, because the document states none.
  static constexpr Time start_up = 100ms;

  static constexpr std::int32_t magnitude(std::int32_t value) { return value < 0 ? -value : value; }
  static constexpr std::uint32_t counts_of(std::int64_t position) { return static_cast<std::uint32_t>(position) >> 8; }

  // Offsets in `memory_` of the zeros of both channels (4 bytes each) and of the turns' offset (8 bytes).
  static constexpr std::size_t zero_at = stored_bytes;
  static constexpr std::size_t turns_at = zero_at + 8;

  // ---- Requests

  [[nodiscard]] bool is_own(Bytes begin) const { return address_of(begin[0]) == profile_.address; }
  // Returns whether the CRC of a request is wrong; false for a request without a CRC.
  [[nodiscard]] bool has_wrong_checksum(Bytes request) const {
    return request.size() > 1 && !has_checksum8(profile_, request);
  }
  // Returns whether the bytes of `heard` end with a complete request for this encoder that begins behind their first
  // byte.
  [[nodiscard]] bool contains_own_request(Bytes heard) const {
    for (std::size_t begin = 1; begin < heard.size(); ++begin) {
      const Bytes rest = heard.subspan(begin);
      const std::optional<DataId> id = data_id(rest[0]);
      if (id && is_own(rest) && rest.size() == request_length(profile_, *id) && !has_wrong_checksum(rest)) return true;
    }
    return false;
  }
  // A request with a wrong parity bit counts with its usual length, because the reply may have to report the parity
  // error.
  [[nodiscard]] std::size_t request_size(Bytes begin) const override {
    const std::optional<DataId> id = data_id(begin[0]);
    if (!id) return 0;
    const std::size_t size = request_length(profile_, *id);
    if (begin.size() >= size) return has_wrong_checksum(begin.first(size)) ? 0 : size;
    if (is_own(begin)) return size;
    return contains_own_request(begin) ? 0 : begin.size() + 1;
  }
  [[nodiscard]] std::size_t others_reply_size(Bytes request) const override {
    return is_own(request) ? 0 : reply_length(*data_id(request[0]));
  }
  [[nodiscard]] bool begins_others_reply(std::uint8_t byte) const override { return byte == others_field_; }
  Answer respond(Bytes bytes, Time at, ByteBuffer<64>& reply) override {
    if (magnitude(shaft_->at(at).speed_millirpm) > overspeed_above) latches_ |= alarms::overspeed;
    others_field_ = bytes[0];
    if (!is_own(bytes)) return Answer::for_others;
    const Result<Request> request = decode_request(profile_, bytes);
    if (!request) {
      forget_rows();
      return report_bad_request(bytes[0], status::parity_error, at, reply);
    }
    const bool executes = count(request->id, at);
    const std::optional<Reply> made =
        is_memory_access(request->id) ? access_memory(*request, at) : reply_to(request->id, at);
    if (!made) return Answer::for_others;
    reply.append(encode_reply(profile_, *made));
    // The reset is executed after its reply is made, because the reply still has the old position, turns and alarms.
    if (executes) execute_reset(request->id, at);
    return Answer::sent;
  }
  bool is_refused(Flaw flaw, Bytes heard) override {
    if (heard.empty() || !is_own(heard)) return false;
    forget_rows();
    if (flaw != Flaw::damaged) return false;
    refused_field_ = heard[0];
    return is_reported(heard[0]);
  }
  void refuse(Time at, ByteBuffer<64>& reply) override {
    report_bad_request(refused_field_, status::stop_error, at, reply);
  }
  // Returns whether the reply to a damaged request with this control field reports the error. Table 5 demands a report
  // in the status field (SF), the overview of the document demands silence: an option decides. Replies to memory
  // requests have no SF, so they report nothing.
  [[nodiscard]] bool is_reported(std::uint8_t field) const {
    return profile_.bad_request == BadRequest::report && !is_memory_access(*data_id(field));
  }
  // Makes the reply that reports a damaged request in the status field (SF); it echoes the control field as received.
  Answer report_bad_request(std::uint8_t field, std::uint8_t status_bit, Time at, ByteBuffer<64>& reply) {
    if (!is_reported(field)) return Answer::for_others;
    const DataId id = *data_id(field);
    Reply report = reply_to(id, at);
    report.one.status |= status_bit;
    report.two.status |= status_bit;
    reply.append(encode_reply(profile_, report, field));
    return Answer::sent;
  }
  void forget_rows() {
    resets_.forget();
    encoder_ids_ = 0;
  }
  // Counts a request for the sequence counters and the resets. Returns whether the request is the eighth of a reset and
  // the shaft is at rest.
  bool count(DataId id, Time at) {
    encoder_ids_ = id == DataId::encoder_id ? encoder_ids_ + 1 : 0;
    if (id == DataId::encoder_id) {
      expect(encoder_ids_ != reset_requests,
             "ID 8 sent eight times in a row: dynamic addressing, which nothing describes", at);
    }
    if (profile_.sequence_step == SequenceStep::request || has_sequence(id)) {
      for (std::uint8_t& counter : counters_) ++counter;
    }
    if (is_reset(id)) return resets_.count(static_cast<unsigned>(id), at, earliest(at)) && stands(at);
    resets_.end();
    return false;
  }
  bool stands(Time at) {
    return expect(magnitude(shaft_->at(at).speed_millirpm) <= standing_still, "reset while the shaft turns", at);
  }
  // Executes a memory request and returns the reply; no reply if the document defines none.
  std::optional<Reply> access_memory(const Request& request, Time at) {
    if (!expect(profile_.bus != sharing_yes, "memory access with several encoders on the line", at))
      return std::nullopt;
    const Access wanted{request.id == DataId::write_memory, request.memory_address, request.value};
    if (!exists(wanted)) return std::nullopt;
    const std::optional<MemoryAnswer> answer = access(wanted, at, earliest(at));
    if (!answer) return std::nullopt;
    return Reply{.id = request.id,
                 .encoder_address = profile_.address,
                 .memory_address = request.memory_address,
                 .busy = answer->busy,
                 .value = answer->value};
  }
  [[nodiscard]] std::uint8_t load(std::uint8_t page, std::uint8_t address) override {
    return page == register_page && address == error_info_address ? error_info() : *stored(page, address);
  }
  void store(std::uint8_t page, std::uint8_t address, std::uint8_t value) override {
    *stored(page, address) = value;
    if (!is_immediate(page, address)) change_memory();
  }
  void execute_reset(DataId id, Time at) {
    if (id == DataId::clear_alarms) {
      latches_ &= static_cast<std::uint8_t>(~alarms::xc_error);
      if (turns_cleared_) latches_ &= static_cast<std::uint8_t>(~alarms::multiturn_error);
      return;
    }
    const std::uint16_t turns_before = turns(at);
    if (id == DataId::zero || value_of(condition::id_d_clears_singleturn) != 0) {
      // Both channels take the present position of the shaft as their zero.
      for (const std::size_t to : {zero_at, zero_at + 4}) {
        store_little_endian(MutableBytes(memory_).subspan(to, 4), counts_of(shaft_->at(at).position));
      }
    }
    if (id == DataId::reset_multiturn) turns_cleared_ = true;
    set_turns(id == DataId::reset_multiturn ? 0 : turns_before, at);
    write_lasts(at + eeprom_write_time);
  }

  // ---- State

  [[nodiscard]] std::uint32_t zero(Channel channel) const {
    const std::size_t at = channel == Channel::one ? zero_at : zero_at + 4;
    return static_cast<std::uint32_t>(load_little_endian(Bytes(memory_).subspan(at, 4)));
  }
  // Returns the position within the turn that `channel` measures from its own zero.
  [[nodiscard]] std::uint32_t singleturn(Channel channel, Time now) const {
    const std::int32_t stuck = value_of(condition::ch1_stuck, channel);
    const std::uint32_t seen = counts_of(shaft_->at(now).position) - zero(channel);
    return (stuck >= 0 ? static_cast<std::uint32_t>(stuck) : seen) & 0xFFFFFF;
  }
  // Returns the turns of the shaft, counted from the zero of channel 1, so that the turns change where the position of
  // channel 1 wraps.
  [[nodiscard]] std::uint64_t shaft_turns(Time now) const {
    return static_cast<std::uint64_t>((shaft_->at(now).position - (std::int64_t{zero(Channel::one)} << 8)) >> 32);
  }
  [[nodiscard]] std::uint16_t turns(Time now) const {
    if (!profile_.turns) return 0;
    const std::uint64_t offset = load_little_endian(Bytes(memory_).subspan(turns_at, 8));
    return static_cast<std::uint16_t>(shaft_turns(now) - offset);
  }
  void set_turns(std::uint16_t turns, Time now) {
    store_little_endian(MutableBytes(memory_).subspan(turns_at, 8), shaft_turns(now) - turns);
    change_memory();
  }
  [[nodiscard]] std::uint8_t alarms_now() const {
    unsigned bits = latches_ | forced_;
    if (value_of(condition::supply_voltage) < under_voltage_below) bits |= alarms::under_voltage;
    if (value_of(condition::supply_voltage) > over_voltage_above) bits |= alarms::over_voltage;
    return static_cast<std::uint8_t>(bits);
  }
  [[nodiscard]] std::uint8_t error_info() const {
    if ((latches_ & alarms::led_or_lissajous_error) == 0) return 0;
    return value_of(condition::lissajous) != 0 ? error_info_lissajous : error_info_led;
  }
  [[nodiscard]] ChannelReply channel_now(Channel channel, Time now) const {
    const unsigned alarms = alarms_now() | static_cast<unsigned>(value_of(condition::ch1_alarms, channel));
    const unsigned led = value_of(condition::lissajous) != 0 ? 0u : unsigned{alarms::led_or_lissajous_error};
    const unsigned safety = alarms::singleturn_error | alarms::memory_error | alarms::voltage | led;
    unsigned bits = channel == Channel::two ? status::channel_2 : 0u;
    if ((alarms & safety) != 0) bits |= status::safety_error;
    if ((alarms & ~safety) != 0) bits |= status::non_safety_error;
    if (value_of(condition::temperature) > warning_above) bits |= status::temperature_warning;
    if (now >= ready_at_) bits |= status::ready;
    if (value_of(condition::forced_test) != 0) bits |= status::forced_test_passed;
    bits |= static_cast<unsigned>(value_of(condition::ch1_status_set, channel));
    bits &= ~static_cast<unsigned>(value_of(condition::ch1_status_clear, channel));
    const std::int32_t stuck = value_of(condition::ch1_sequence, channel);
    const int counter = stuck >= 0 ? stuck : counters_[static_cast<std::size_t>(channel)];
    return {.status = static_cast<std::uint8_t>(bits),
            .alarms = static_cast<std::uint8_t>(alarms),
            .sequence = static_cast<std::uint8_t>(channel == Channel::one ? counter : counter & 0x7F),
            .encoder_id = encoder_id(profile_)};
  }

  // ---- Power

  void started(Time) override {
    restart_memory();
    registers_.fill(0);
    counters_.fill(0);
  }
  void stopped(Time) override {
    // The alarms about turns survive power off; the other latched alarms do not.
    latches_ &= alarms::turns_wrong;
    turns_cleared_ = false;
    forget_rows();
  }
  // Returns the value of a condition. `index` is that of channel 1; the condition of channel 2 has the next index.
  [[nodiscard]] std::int32_t value_of(std::size_t index, Channel channel = Channel::one) const {
    return condition_[index + (channel == Channel::two ? 1 : 0)];
  }

  Profile profile_;
  const Shaft* shaft_;
  std::array<std::int32_t, conditions.size()> condition_{};
  std::array<std::uint8_t, turns_at + 8> memory_{};
  // bytes of the memory areas with registers, which are lost at power off
  std::array<std::uint8_t, register_bytes> registers_{};

  Time ready_at_{};
  std::uint8_t latches_ = 0;
  std::uint8_t forced_ = 0;  // mask of the voltage alarms that `raise_alarms` raised
  // whether a reset with data ID D was executed, so that one with ID C can clear multiturn_error
  bool turns_cleared_ = false;
  std::array<std::uint8_t, 2> counters_{};

  author::RowCounter resets_{reset_row, rules()};
  unsigned encoder_ids_ = 0;        // number of consecutive requests with data ID 8
  std::uint8_t refused_field_ = 0;  // control field of the last damaged request for this encoder
  // control field of the last request; if the request was for another encoder, that encoder's reply begins with this
  // byte
  std::uint8_t others_field_ = 0;
};

}  // namespace absenc::esl
