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

// Those of an AksIM-4 are others, which are not described.
const Register* VirtualEncoder::find(std::uint32_t address) const {
  return build_.protocol_version == version::aksim2 ? find_register(address) : nullptr;
}

void VirtualEncoder::execute_read(const RegisterRequest& request, Time at) {
  const Register* found = find(request.address);
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
  const Register* found = find(request.address);
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
      if (value > build_.offset.largest(format_.resolution)) return AccessStatus::out_of_range;
      settings_.offset = static_cast<std::uint32_t>(value);
      return AccessStatus::ok;
    case multiturn_preset:
      if (value > low_mask(static_cast<unsigned>(format_.multiturn_bits))) return AccessStatus::out_of_range;
      settings_.preset = static_cast<std::uint32_t>(value);
      settings_.turns = static_cast<std::uint32_t>(static_cast<std::uint64_t>(place(at) >> 32) - value);
      return AccessStatus::ok;
    case position_filter:
    case position_filter_speed:
    case velocity_filter:
    case velocity_filter_speed:
      settings_.filters[index - position_filter] = static_cast<std::uint32_t>(value);
      return AccessStatus::ok;
    case calibration_range:
      settings_.calibration_range = static_cast<std::uint16_t>(value);
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

// 0: of what a calibration or the factory would have found.
std::uint64_t VirtualEncoder::number_of(std::size_t index, Time at) const {
  switch (index) {
    case position_offset:
      return settings_.offset;
    case multiturn_preset:
      return settings_.preset;
    case position_filter:
    case position_filter_speed:
    case velocity_filter:
    case velocity_filter_speed:
      return settings_.filters[index - position_filter];
    case calibration_range:
      return settings_.calibration_range;
    case write_lock:
      return settings_.lock;
    case firmware_major:
      return firmware_major_value;
    case firmware_minor:
      return firmware_minor_value;
    case protocol_register:
      return build_.protocol_version;
    case temperature:
      return static_cast<std::uint64_t>(build_.temperature);
    case speed:
      return static_cast<std::uint64_t>(std::int64_t{shaft_->at(at).speed_millirpm} / 100);
    case calibration_status:
      return calibration_status_;
    default:
      return 0;
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

// ---- What `save` keeps

void VirtualEncoder::load() {
  const Bytes bytes = memory_;
  settings_.offset = static_cast<std::uint32_t>(load_big_endian(bytes.first(4)));
  settings_.preset = static_cast<std::uint32_t>(load_big_endian(bytes.subspan(4, 4)));
  settings_.lock = bytes[8];
  settings_.turns = static_cast<std::uint32_t>(load_big_endian(bytes.subspan(9, 4)));
  for (std::size_t i = 0; i < settings_.filters.size(); ++i) {
    settings_.filters[i] = static_cast<std::uint32_t>(load_big_endian(bytes.subspan(13 + 4 * i, 4)));
  }
  settings_.calibration_range = static_cast<std::uint16_t>(load_big_endian(bytes.subspan(29, 2)));
}

void VirtualEncoder::store() {
  const MutableBytes bytes = memory_;
  store_big_endian(bytes.first(4), settings_.offset);
  store_big_endian(bytes.subspan(4, 4), settings_.preset);
  bytes[8] = settings_.lock;
  store_big_endian(bytes.subspan(9, 4), settings_.turns);
  for (std::size_t i = 0; i < settings_.filters.size(); ++i) {
    store_big_endian(bytes.subspan(13 + 4 * i, 4), settings_.filters[i]);
  }
  store_big_endian(bytes.subspan(29, 2), settings_.calibration_range);
  ++memory_version_;
}

}  // namespace absenc::encolink
