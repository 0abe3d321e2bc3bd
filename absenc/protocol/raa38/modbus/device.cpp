// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/modbus/device.hpp"

#include <algorithm>

namespace absenc::raa38::rtu {

namespace {

using modbus::Exception;
using modbus::FrameBytes;
using namespace std::chrono_literals;

// A host that writes more than `most_settings` settings within `settings_window` breaks the document's rule "Do not
// regularly send".
constexpr std::uint32_t most_settings = 10;
constexpr Time settings_window = 1min;

constexpr bool is_address(std::uint8_t address) {
  return address >= modbus::first_address && address <= modbus::last_address;
}

}  // namespace

// A memory from a file may hold an invalid address or baud rate; the format's value then replaces it.
void VirtualEncoder::started() {
  if (!is_address(address())) memory()[Settings::number_at] = format_.address;
  if (settings_.rate() >= bauds.size()) memory()[Settings::rate_at] = static_cast<std::uint8_t>(format_.baud);
  set_rate(baud());
}

void VirtualEncoder::request(Bytes body, Time at, FrameBytes& reply) {
  if (body.size() == 2 && body[0] == any_address && body[1] == function::read_address) {
    check_line_rules(at);
    expect_collision();
    reply.append(body);
    reply.push_back(address());
    set_crc_order(format_.address_crc);
    return;
  }
  if (body[0] != address()) return;
  check_line_rules(at);
  switch (body[1]) {
    case function::read:
      return read(body, at, reply);
    case function::set_address:
      return set_address(body, at, reply);
    case function::set_parameter:
      return set_parameter(body, at, reply);
    default:
      // Function codes from 80 (hex) on get no reply: they are refusals of other slaves, and A0, which only address FF
      // may carry.
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
  // A request of one register is refused if the position has more than 16 bits: the lower 16 bits would look like a
  // whole position.
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
  const std::uint32_t position = settings_.position(at);
  for (unsigned i = size; i-- > 0;) reply.push_back(static_cast<std::uint8_t>(position >> 8 * i));
}

void VirtualEncoder::set_address(Bytes body, Time at, FrameBytes& reply) {
  if (body.size() != 3) return;
  const std::uint8_t address = body[2];
  if (!expect(is_address(address), "an address was set that no slave can have", at)) return;
  wrote(settings_.write(Settings::number_at, {&address, 1}), at);
  reply.push_back(address);
  reply.push_back(function::set_address);
}

void VirtualEncoder::set_parameter(Bytes body, Time at, FrameBytes& reply) {
  if (body.size() != 3) return;
  const bool known = apply(body[2], at);
  if (expect(known, "a parameter was set that the document does not have", at)) reply.append(body);
}

bool VirtualEncoder::apply(std::uint8_t value, Time at) {
  const auto baud_found = std::find(baud_parameters.begin(), baud_parameters.end(), value);
  if (value == parameter::zero) {
    wrote(settings_.write_zero(at), at);
  } else if (value == parameter::positive || value == parameter::negative) {
    const std::uint8_t down = value == parameter::negative ? 1 : 0;
    wrote(settings_.write(Settings::direction_at, {&down, 1}), at);
  } else if (baud_found != baud_parameters.end()) {
    const auto index = static_cast<std::uint8_t>(baud_found - baud_parameters.begin());
    wrote(settings_.write(Settings::rate_at, {&index, 1}), at);
    set_rate(baud());  // the reply to the setting is still sent at the old baud rate
  } else {
    return false;
  }
  return true;
}

void VirtualEncoder::wrote(bool changed, Time now) {
  expect(changed, "a setting was sent that the encoder has already: its memory wears out", now);
  if (now - recent_since_ > settings_window) {
    recent_since_ = now;
    recent_settings_ = 0;
  }
  expect(++recent_settings_ != most_settings + 1, "settings are sent again and again: the memory wears out", now);
}

}  // namespace absenc::raa38::rtu
