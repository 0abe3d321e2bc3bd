// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/device.hpp"

#include <algorithm>

namespace absenc::encolink {

namespace {

// part number, 16 characters; characters 8 and 9 are the resolution in bits
constexpr std::string_view part_text = "MB080SLA20MENT00";
constexpr std::string_view access_rule = "register access before the last one was answered";
// Assumed time from the last byte of a register access until its answer is ready.
constexpr Time access_time = 200us;

struct Text {
  std::size_t index;
  std::string_view text;
};
constexpr std::array<Text, 3> texts{
    {{serial_number, "AK2A0001"}, {serial_number_extended, "AK2A0001-0000001"}, {part_number, "MB080SLA20MENT00 SIM"}}};

// Index in `values_` of the turns that a preset subtracts from the shaft's turns.
constexpr std::size_t turns_taken = registers.size();
// Register values at shipping; registers that are not set here are 0.
constexpr auto at_shipping = [] {
  std::array<std::uint32_t, turns_taken + 1> values{};
  values[firmware_major] = 1;
  values[firmware_minor] = 4;
  values[protocol_register] = version::aksim2;
  return values;
}();

// Indices of the register values that the command `save` stores, in the order of their bytes in the memory.
constexpr std::array<std::size_t, 9> stored_registers{position_offset, multiturn_preset,      write_lock,
                                                      turns_taken,     position_filter,       position_filter_speed,
                                                      velocity_filter, velocity_filter_speed, calibration_range};

}  // namespace

VirtualEncoder::VirtualEncoder(const Format& format, const Shaft& shaft)
    : Responder({.character = uart_settings.character(), .answer_time = answer_time}), format_(format), shaft_(&shaft) {
  if (format_.resolution == 0) format_.resolution = virtual_format.resolution;
  if (format_.multiturn_bits < 0) format_.multiturn_bits = virtual_format.multiturn_bits;
  for (std::size_t i = 0; i < conditions.size(); ++i) conditions_[i] = conditions[i].normal;
}

// ---- The line

ByteStep VirtualEncoder::next(Time now) {
  const bool streams = format_.stream_rate > 0 && format_.interface == Interface::uart;
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
  if (format_.interface == Interface::uart) {
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
  // The vendor's library reads 20 bytes both for the identity and for the frame before it.
  const bool identifies = frame.size() == identity_bytes || request[0] == static_cast<std::uint8_t>(Config::identify);
  while (identifies && reply.size() < format_.identity_size && format_.identity_size > identity_bytes) {
    reply.push_back(0);
  }
  handle(request, at);
  return Answer::sent;
}

void VirtualEncoder::selected(Time at) {
  if (was_selected_) expect(at - pause_since_ >= spi_pause, "NCS high for less than 5 us", at);
  was_selected_ = true;
  if (is_on(at)) transmit(make_frame(at), at);
}

void VirtualEncoder::stopped_clocking(const ByteEvent& event) {
  pause_since_ = event.at;
  if (event.bits > 0) expect(event.lead >= spi_lead, "clock less than 5 us after NCS went low", event.at);
  if (event.width > Time{}) expect(event.width >= shortest_clock, "clock faster than 4 MHz", event.at);
}

ReplyBytes VirtualEncoder::make_frame(Time now) {
  // While it starts, the encoder sends well-formed frames whose position is zero.
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

// Executes a request. The reply of this exchange was made before, so the effect shows in the next frame.
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
  sent_answer_bytes_ = 0;
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
  if (sent_answer_bytes_ == answer_.size()) return channel3::idle;
  if (now < busy_until_ || conditions_[condition_busy] != 0) return channel3::busy;
  return answer_[sent_answer_bytes_++];
}

void VirtualEncoder::ra_received(std::uint8_t byte, Time at) {
  if (access_.size() < access_keys.size() && byte != access_keys[access_.size()]) access_.clear();
  if (access_.empty() && byte != access_keys[0]) return;
  access_.push_back(byte);
  if (access_.size() == 2 && !expect(sent_answer_bytes_ == answer_.size(), access_rule, at)) access_.clear();
  if (access_.size() < access_header) return;
  const auto length = static_cast<std::size_t>(load_big_endian(access_.view().subspan(access_keys.size() + 1, 2)));
  const bool writes = access_[access_keys.size()] == static_cast<std::uint8_t>(RegisterRequest::Operation::write);
  if (access_.size() == access_header + (writes ? std::min(length, access_capacity) : 0) + 1) execute(at);
}

// ---- State

// Returns the position of the shaft with the offset applied, in 2^-32 revolution, as if the turn counter had no limit.
std::int64_t VirtualEncoder::offset_position(Time now) const {
  const auto fraction = static_cast<std::int32_t>(format_.offset_fraction(offset()));
  const std::int64_t position = shaft_->at(now).position;
  return format_.offset_sign == OffsetSign::add ? position + fraction : position - fraction;
}

Position VirtualEncoder::measure(Time now) const {
  const std::int64_t here = offset_position(now);
  const auto turns = static_cast<std::uint32_t>(here >> 32) - values_[turns_taken];
  Position position;
  position.singleturn = static_cast<std::uint32_t>(here) >> (32 - format_.resolution);
  position.multiturn = static_cast<std::uint16_t>(turns & low_mask(static_cast<unsigned>(format_.multiturn_bits)));
  position.error = (alarms() & status::errors) != 0;
  position.warning = (alarms() & status::warnings) != 0;
  return position;
}

// Executes a pending save and ends a self-calibration, if they are due at `now`.
void VirtualEncoder::update(Time now) {
  if (save_pending_ && now >= busy_until_) save();
  if (calibrating_ && now >= calibrated_at_) end_calibration(now);
}

void VirtualEncoder::end_calibration(Time now) {
  calibrating_ = false;
  const std::int64_t turned = shaft_->at(now).position - calibrated_from_;
  constexpr std::int64_t one_turn = std::int64_t{1} << 32;
  std::uint32_t& status = values_[calibration_status];
  const bool too_little = turned < one_turn && -turned < one_turn;
  status = too_little ? status | calibration::timed_out : (status + 1) & calibration::count;
}

// ---- Power

void VirtualEncoder::power_on(Time now, PowerOn kind) {
  load();
  zeros_until_ = next_frame_ = now;
  if (kind == PowerOn::real) zeros_until_ += start_up;
  busy_until_ = Time{};
  reset_channels();
  Responder::power_on(now, kind);
}

void VirtualEncoder::stopped(Time now) {
  update(now);
  save_pending_ = calibrating_ = identity_next_ = false;
}

// ---- Registers

void VirtualEncoder::execute(Time at) {
  const Result<RegisterRequest> request = decode_access(access_);
  const bool writes = access_[access_keys.size()] == static_cast<std::uint8_t>(RegisterRequest::Operation::write);
  access_.clear();
  answer_.clear();
  sent_answer_bytes_ = 0;
  busy_until_ = std::max(busy_until_, at + access_time);
  if (request.error() == Error::unsupported) return;  // the encoder ignores an unknown operation: channel 3 stays idle
  AccessStatus status = writes ? AccessStatus::write_checksum : AccessStatus::read_checksum;
  if (request.error() == Error::wrong_length) status = AccessStatus::byte_count;
  std::size_t index = 0;
  if (request) {
    // The registers of an AksIM-4 are not documented, so its virtual encoder has none.
    const Register* found = format_.generation == Generation::aksim2 ? find_register(request->address) : nullptr;
    if (found != nullptr) index = static_cast<std::size_t>(found - registers.data());
    status = check_access(*request, found);
    if (status == AccessStatus::ok && writes) status = write(index, load_big_endian(request->data), at);
  }
  answer_.push_back(writes ? channel3::write_ready : channel3::read_ready);
  answer_.push_back(static_cast<std::uint8_t>(status));
  if (!request || writes) return;
  if (status == AccessStatus::ok) {
    answer_.append(value_of(index, at));
  } else {  // the vendor's host reads all requested bytes even if the status is an error
    for (std::size_t i = 0; i < std::min<std::size_t>(request->length, access_capacity); ++i) answer_.push_back(0);
  }
}

AccessStatus VirtualEncoder::check_access(const RegisterRequest& request, const Register* found) const {
  const bool writes = request.operation == RegisterRequest::Operation::write;
  if (found == nullptr) return AccessStatus::no_such_register;
  if (writes && found->access == Access::read_only) return AccessStatus::denied;
  if (found->size != request.length) return AccessStatus::byte_count;
  if (!writes) return found->access == Access::write_only ? AccessStatus::denied : AccessStatus::ok;
  const bool opens = found == &registers[write_lock];
  return values_[write_lock] != 0 && !opens ? AccessStatus::locked : AccessStatus::ok;
}

AccessStatus VirtualEncoder::write(std::size_t index, std::uint64_t value, Time at) {
  std::uint64_t largest = UINT64_MAX;
  if (index == command_register) return execute_command(static_cast<std::uint8_t>(value), at);
  if (index == position_offset) largest = format_.largest_offset();
  if (index == multiturn_preset) largest = low_mask(static_cast<unsigned>(format_.multiturn_bits));
  if (index == write_lock) largest = 1;
  if (value > largest) return AccessStatus::out_of_range;
  values_[index] = static_cast<std::uint32_t>(value);
  if (index == multiturn_preset) {
    values_[turns_taken] = static_cast<std::uint32_t>(static_cast<std::uint64_t>(offset_position(at) >> 32) - value);
    lower_alarms(status::multiturn_mismatch);
  }
  return AccessStatus::ok;
}

AccessStatus VirtualEncoder::execute_command(std::uint8_t command, Time at) {
  const std::uint32_t calibrated = values_[calibration_status];
  switch (command) {
    case commands::save:
      save_pending_ = true;
      busy_until_ = at + save_time;
      return AccessStatus::ok;
    case commands::reset:
      values_ = at_shipping;
      values_[calibration_status] = calibrated;
      return AccessStatus::ok;
    case commands::self_calibrate:
      calibrating_ = true;
      calibrated_at_ = at + calibration_time;
      calibrated_from_ = shaft_->at(at).position;
      values_[calibration_status] = calibrated & calibration::count;
      return AccessStatus::ok;
    default:
      return AccessStatus::out_of_range;
  }
}

ByteBuffer<largest_register> VirtualEncoder::value_of(std::size_t index, Time at) const {
  ByteBuffer<largest_register> bytes;
  for (const Text& one : texts) {
    if (one.index != index) continue;
    for (const char c : one.text) bytes.push_back(static_cast<std::uint8_t>(c));
    return bytes;
  }
  std::uint64_t number = values_[index];
  if (index == temperature) number = static_cast<std::uint64_t>(10 * conditions_[condition_temperature]);
  if (index == speed) number = static_cast<std::uint64_t>(std::int64_t{shaft_->at(at).speed_millirpm} / 100);
  std::array<std::uint8_t, 8> all{};
  store_big_endian(all, number);
  bytes.append(Bytes(all).last(registers[index].size));
  return bytes;
}

// ---- Non-volatile memory

constexpr std::size_t stored_size(std::size_t index) { return index == turns_taken ? 4 : registers[index].size; }

void VirtualEncoder::load() {
  values_ = at_shipping;
  Bytes bytes = memory_;
  for (const std::size_t index : stored_registers) {
    values_[index] = static_cast<std::uint32_t>(load_big_endian(bytes.first(stored_size(index))));
    bytes = bytes.subspan(stored_size(index));
  }
}

void VirtualEncoder::save() {
  save_pending_ = false;
  MutableBytes bytes = memory_;
  for (const std::size_t index : stored_registers) {
    store_big_endian(bytes.first(stored_size(index)), values_[index]);
    bytes = bytes.subspan(stored_size(index));
  }
  change_memory();
  lower_alarms(status::configuration_error);  // the stored configuration is complete again after a save
}

}  // namespace absenc::encolink
