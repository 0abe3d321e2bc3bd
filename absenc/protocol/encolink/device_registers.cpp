// SPDX-License-Identifier: Apache-2.0
// The registers of the virtual AksIM-2: what an access to them does, what they hold, what survives without power.
#include <algorithm>

#include "absenc/protocol/encolink/device.hpp"

namespace absenc::encolink {

namespace {

constexpr Time access_time = 200us;  // until an access is executed; assumed
constexpr std::string_view serial_text = "AK2A0001";
constexpr std::string_view extended_serial_text = "AK2A0001-0000001";  // 16 characters
constexpr std::string_view order_text = "MB080SLA20MENT00 SIM";        // 20 characters
constexpr std::uint64_t firmware_major_value = 1;
constexpr std::uint64_t firmware_minor_value = 4;

// What `save` keeps, one after the other.
struct Kept {
  std::size_t value;
  std::size_t size;
};
constexpr std::array<Kept, 9> kept{{{position_offset, 4},
                                    {multiturn_preset, 4},
                                    {write_lock, 1},
                                    {registers.size(), 4},  // the turns that a preset takes off
                                    {position_filter, 4},
                                    {position_filter_speed, 4},
                                    {velocity_filter, 4},
                                    {velocity_filter_speed, 4},
                                    {calibration_range, 2}}};

ByteBuffer<20> text_value(std::string_view text) {
  ByteBuffer<20> bytes;
  for (const char c : text) bytes.push_back(static_cast<std::uint8_t>(c));
  return bytes;
}

}  // namespace

void VirtualEncoder::execute(Time at) {
  const Result<RegisterRequest> request = decode_access(access_);
  const bool writes = access_[access_keys.size()] == static_cast<std::uint8_t>(RegisterRequest::Operation::write);
  access_.clear();
  answer_.clear();
  answered_bytes_ = 0;
  busy_until_ = std::max(busy_until_, at + access_time);
  if (request.error() == Error::unsupported) return;  // no operation of this number: it stays idle
  AccessStatus status = writes ? AccessStatus::write_checksum : AccessStatus::read_checksum;
  if (request.error() == Error::wrong_length) status = AccessStatus::byte_count;
  // The registers of an AksIM-4 are others, which are not described.
  const Register* found =
      request && format_.generation == Generation::aksim2 ? find_register(request->address) : nullptr;
  const std::size_t index = found != nullptr ? static_cast<std::size_t>(found - registers.data()) : 0;
  if (request) status = judge(*request, found);
  if (request && status == AccessStatus::ok && writes) status = write(index, load_big_endian(request->data), at);
  answer_.push_back(writes ? channel3::write_ready : channel3::read_ready);
  answer_.push_back(static_cast<std::uint8_t>(status));
  if (!request || writes) return;
  if (status == AccessStatus::ok) {
    answer_.append(value_of(index, at));
  } else {  // the vendor's host takes the bytes it asked for whatever the status says
    for (std::size_t i = 0; i < std::min<std::size_t>(request->length, access_capacity); ++i) answer_.push_back(0);
  }
}

AccessStatus VirtualEncoder::judge(const RegisterRequest& request, const Register* found) const {
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
  if (index == command_register) return obey(static_cast<std::uint8_t>(value), at);
  if (index == position_offset) largest = format_.largest_offset();
  if (index == multiturn_preset) largest = low_mask(static_cast<unsigned>(format_.multiturn_bits));
  if (index == write_lock) largest = 1;
  if (value > largest) return AccessStatus::out_of_range;
  values_[index] = static_cast<std::uint32_t>(value);
  if (index == multiturn_preset) {
    values_[turns_taken] = static_cast<std::uint32_t>(static_cast<std::uint64_t>(place(at) >> 32) - value);
  }
  return AccessStatus::ok;
}

AccessStatus VirtualEncoder::obey(std::uint8_t command, Time at) {
  switch (command) {
    case commands::save:
      save_pending_ = true;
      busy_until_ = at + save_time;
      return AccessStatus::ok;
    case commands::reset:
      values_ = {};
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

// 0: of what a calibration or the factory would have found.
std::uint64_t VirtualEncoder::number_of(std::size_t index, Time at) const {
  switch (index) {
    case firmware_major:
      return firmware_major_value;
    case firmware_minor:
      return firmware_minor_value;
    case protocol_register:
      return version::aksim2;
    case temperature:
      return static_cast<std::uint64_t>(10 * conditions_[condition_temperature]);
    case speed:
      return static_cast<std::uint64_t>(std::int64_t{shaft_->at(at).speed_millirpm} / 100);
    case calibration_status:
      return calibration_status_;
    default:
      return values_[index];
  }
}

ByteBuffer<20> VirtualEncoder::value_of(std::size_t index, Time at) const {
  switch (index) {
    case serial_number:
      return text_value(serial_text);
    case serial_number_extended:
      return text_value(extended_serial_text);
    case part_number:
      return text_value(order_text);
    default:
      break;
  }
  std::array<std::uint8_t, 8> bytes{};
  store_big_endian(bytes, number_of(index, at));
  ByteBuffer<20> result;
  result.append(Bytes(bytes).last(registers[index].size));
  return result;
}

// ---- What survives without power

void VirtualEncoder::load() {
  Bytes bytes = memory_;
  for (const Kept& one : kept) {
    values_[one.value] = static_cast<std::uint32_t>(load_big_endian(bytes.first(one.size)));
    bytes = bytes.subspan(one.size);
  }
}

void VirtualEncoder::save() {
  save_pending_ = false;
  MutableBytes bytes = memory_;
  for (const Kept& one : kept) {
    store_big_endian(bytes.first(one.size), values_[one.value]);
    bytes = bytes.subspan(one.size);
  }
  change_memory();
}

}  // namespace absenc::encolink
