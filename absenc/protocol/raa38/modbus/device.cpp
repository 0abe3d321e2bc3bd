// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/modbus/device.hpp"

#include <algorithm>

#include "absenc/core/bits.hpp"

namespace absenc::raa38::rtu {

namespace {

using modbus::Exception;
using modbus::FrameBytes;
using namespace std::chrono_literals;

// "Do not regularly send in case the internal structure of the device would be damaged": what nobody needs in a minute.
constexpr std::uint32_t most_settings = 10;
constexpr Time settings_window = 1min;

constexpr bool is_address(std::uint8_t address) {
  return address >= modbus::first_address && address <= modbus::last_address;
}

}  // namespace

VirtualEncoder::VirtualEncoder(const Format& format, const Shaft& shaft)
    : Server(format.line()), format_(format), shaft_(&shaft) {
  memory_[address_at] = format.address;
  memory_[baud_at] = static_cast<std::uint8_t>(format.baud);
}

// A memory that came from outside may hold anything.
void VirtualEncoder::started() {
  if (!is_address(address())) memory_[address_at] = format_.address;
  if (memory_[baud_at] >= bauds.size()) memory_[baud_at] = static_cast<std::uint8_t>(format_.baud);
  set_rate(baud());
}

std::uint32_t VirtualEncoder::writes() const {
  return static_cast<std::uint32_t>(load_little_endian(Bytes(memory_).subspan(writes_at, 4)));
}

std::uint32_t VirtualEncoder::counts(Time now) const {
  return static_cast<std::uint32_t>(shaft_->at(now).position) >> (32 - format_.bits);
}

// The direction mirrors the position at the zero.
std::uint32_t VirtualEncoder::singleturn(Time now) const {
  const auto zero = static_cast<std::uint32_t>(load_little_endian(Bytes(memory_).subspan(zero_at, 4)));
  const std::uint32_t forward = counts(now) - zero;
  return static_cast<std::uint32_t>((counts_backwards() ? 0u - forward : forward) & low_mask(format_.bits));
}

void VirtualEncoder::request(Bytes body, Time at, FrameBytes& reply) {
  if (body.size() == 2 && body[0] == any_address && body[1] == function::ask_address) {
    heed_line(at);
    expect_company();
    reply.append(body);
    reply.push_back(address());
    return;
  }
  if (body[0] != address()) return;
  heed_line(at);
  switch (body[1]) {
    case function::read:
      return read(body, at, reply);
    case function::set_address:
      return set_address(body, at, reply);
    case function::set_parameter:
      return set_parameter(body, at, reply);
    default:
      // Codes from 80 on are refusals; of the maker's own, A0 is only for address FF.
      if (body[1] < modbus::refusal_bit) refuse(reply, address(), body[1], Exception::illegal_function);
  }
}

void VirtualEncoder::read(Bytes body, Time at, FrameBytes& reply) {
  const auto refused = [&](Exception why) { refuse(reply, address(), function::read, why); };
  if (body.size() != 6) return refused(Exception::illegal_data_value);
  const auto first = static_cast<std::uint16_t>(body[2] << 8 | body[3]);
  const auto registers = static_cast<std::uint16_t>(body[4] << 8 | body[5]);
  if (registers == 0 || registers > modbus::most_registers) return refused(Exception::illegal_data_value);
  if (first != 0 || registers > 2) return refused(Exception::illegal_data_address);
  // One register would hold a part of the position that looks like a whole one.
  if (registers == 1 && format_.bits > 16) return refused(Exception::illegal_data_value);
  append_position(registers, at, reply);
}

void VirtualEncoder::append_position(std::uint16_t registers, Time at, FrameBytes& reply) const {
  unsigned size = 2u * registers;
  if (registers == 2 && format_.data != Data::four_bytes) size = 3;
  const bool counted_as_four = registers == 2 && format_.data != Data::three_bytes;
  reply.push_back(address());
  reply.push_back(function::read);
  reply.push_back(static_cast<std::uint8_t>(counted_as_four ? 4 : size));
  const std::uint32_t position = singleturn(at);
  for (unsigned i = size; i-- > 0;) reply.push_back(static_cast<std::uint8_t>(position >> 8 * i));
}

void VirtualEncoder::set_address(Bytes body, Time at, FrameBytes& reply) {
  if (body.size() != 3) return;
  const std::uint8_t address = body[2];
  if (!is_address(address)) return violate("an address was set that no slave can have", at);
  write(address_at, {&address, 1}, at);
  reply.push_back(address);
  reply.push_back(function::set_address);
}

void VirtualEncoder::set_parameter(Bytes body, Time at, FrameBytes& reply) {
  if (body.size() != 3) return;
  if (!apply(body[2], at)) return violate("a parameter was set that the document does not have", at);
  reply.append(body);
}

bool VirtualEncoder::apply(std::uint8_t value, Time at) {
  if (value == parameter::zero) {
    std::array<std::uint8_t, 4> zero{};
    store_little_endian(zero, counts(at));
    write(zero_at, zero, at);
    return true;
  }
  if (value == parameter::positive || value == parameter::negative) {
    const std::uint8_t backwards = value == parameter::negative ? 1 : 0;
    write(direction_at, {&backwards, 1}, at);
    return true;
  }
  const auto found = std::find(baud_parameters.begin(), baud_parameters.end(), value);
  if (found == baud_parameters.end()) return false;
  const auto index = static_cast<std::uint8_t>(found - baud_parameters.begin());
  write(baud_at, {&index, 1}, at);
  set_rate(baud());  // the reply goes out at the old one
  return true;
}

void VirtualEncoder::write(std::size_t at, Bytes value, Time now) {
  const MutableBytes kept = MutableBytes(memory_).subspan(at, value.size());
  if (std::equal(value.begin(), value.end(), kept.begin())) {
    violate("a setting was sent that the encoder has already: its memory wears out", now);
  }
  if (now - recent_since_ > settings_window) {
    recent_since_ = now;
    recent_settings_ = 0;
  }
  if (++recent_settings_ == most_settings + 1) {
    violate("settings are sent again and again: the memory wears out", now);
  }
  std::copy(value.begin(), value.end(), kept.begin());
  store_little_endian(MutableBytes(memory_).subspan(writes_at, 4), writes() + 1u);
  ++memory_version_;
}

}  // namespace absenc::raa38::rtu
