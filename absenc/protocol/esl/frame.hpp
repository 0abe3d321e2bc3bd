// SPDX-License-Identifier: Apache-2.0
// QS35 ESL frames (RS-485, 10 Mbps, 8N1, LSB first): encode, decode and every check a frame allows.
// Table numbers are those of the ESL Protocol Specification, rev 1.5; README.md draws the frames.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/result.hpp"
#include "absenc/protocol/esl/check.hpp"
#include "absenc/protocol/esl/checksum.hpp"
#include "absenc/protocol/esl/layout.hpp"
#include "absenc/protocol/esl/profile.hpp"

namespace absenc::esl {

/// Bits of SF in the order of the document (Table 5); `status_order` tells how the wire has them.
namespace status {
inline constexpr std::uint8_t parity_error = 0x01;
inline constexpr std::uint8_t stop_error = 0x02;
inline constexpr std::uint8_t safety_error = 0x04;
inline constexpr std::uint8_t non_safety_error = 0x08;
inline constexpr std::uint8_t temperature_warning = 0x10;
inline constexpr std::uint8_t channel_2 = 0x20;
inline constexpr std::uint8_t ready = 0x40;
inline constexpr std::uint8_t forced_test_passed = 0x80;
inline constexpr std::uint8_t rejected = parity_error | stop_error;
}  // namespace status

/// Bits of ALM (Table 7).
namespace alarms {
inline constexpr std::uint8_t xc_error = 0x01;
inline constexpr std::uint8_t multiturn_error = 0x02;
inline constexpr std::uint8_t led_or_lissajous_error = 0x04;
inline constexpr std::uint8_t overspeed = 0x08;
inline constexpr std::uint8_t memory_error = 0x10;
inline constexpr std::uint8_t singleturn_error = 0x20;
inline constexpr std::uint8_t under_voltage = 0x40;
inline constexpr std::uint8_t over_voltage = 0x80;
inline constexpr std::uint8_t voltage = under_voltage | over_voltage;
inline constexpr std::uint8_t turns_wrong = xc_error | multiturn_error;
/// Those that take a position its safety; the position within the turn is not used with them.
inline constexpr std::uint8_t unsafe = led_or_lissajous_error | memory_error | singleturn_error | voltage;
}  // namespace alarms

inline constexpr unsigned singleturn_bits = 24;
inline constexpr unsigned multiturn_bits = 16;
inline constexpr unsigned redundant_bits = 9;
inline constexpr std::uint8_t page_select_address = 0x7F;
inline constexpr std::size_t request_capacity = 4;
inline constexpr std::size_t reply_capacity = 18;
using RequestBytes = ByteBuffer<request_capacity>;
using ReplyBytes = ByteBuffer<reply_capacity>;

/// EAD, the id, its parity bit, which makes the number of ones odd.
[[nodiscard]] constexpr std::uint8_t control_field(const Profile& profile, unsigned address, std::uint8_t id) {
  const unsigned covered = profile.parity_scope == ParityScope::all ? address << 4 | id : id;
  return static_cast<std::uint8_t>((address & 7) | (id & 0xFu) << 3 | (odd_parity(covered) ? 0 : 0x80));
}
[[nodiscard]] constexpr std::uint8_t control_field(const Profile& profile, unsigned address, DataId id) {
  return control_field(profile, address, static_cast<std::uint8_t>(id));
}
[[nodiscard]] constexpr std::uint8_t address_of(std::uint8_t field) { return field & 7; }

struct Request {
  DataId id = DataId::position;
  std::uint8_t encoder_address = 0;  // 0 to 7
  std::uint8_t memory_address = 0;   // memory access: 0 to 7F
  std::uint8_t value = 0;            // write_memory
};

struct ChannelReply {
  std::uint8_t status = 0;  // bits in the order of the document
  std::uint8_t alarms = 0;
  std::uint8_t sequence = 0;  // 8 bits in channel 1, 7 in channel 2
  std::uint8_t encoder_id = 0;
};

/// Fields that the id does not carry are 0.
struct Reply {
  DataId id = DataId::position;
  std::uint8_t encoder_address = 0;
  ChannelReply one{};
  ChannelReply two{.status = status::channel_2};
  std::uint32_t singleturn = 0;
  std::uint16_t multiturn = 0;
  std::uint16_t redundant = 0;  // 9 bits; 16 of ID 6 where the profile says so
  std::uint8_t temperature = 0;
  std::uint8_t memory_address = 0;
  bool busy = false;
  std::uint8_t value = 0;
  bool unused_bits = false;  // decoded: a bit that is always 0 was set
};

namespace detail {

// T-format has DD in b0..3, EA in b4..5, CA in b6..7.
[[nodiscard]] constexpr std::uint8_t status_to_wire(const Profile& profile, std::uint8_t value) {
  if (profile.status_order == FieldOrder::document) return value;
  return static_cast<std::uint8_t>(value >> 4 | (value & 0x0C) << 2 | (value & 0x03) << 6);
}
[[nodiscard]] constexpr std::uint8_t status_from_wire(const Profile& profile, std::uint8_t value) {
  if (profile.status_order == FieldOrder::document) return value;
  return static_cast<std::uint8_t>(value << 4 | (value >> 2 & 0x0C) | value >> 6);
}

[[nodiscard]] constexpr std::uint8_t address_to_wire(const Profile& profile, std::uint8_t address, bool busy) {
  if (profile.memory_address_order == FieldOrder::document) {
    return static_cast<std::uint8_t>(address << 1 | (busy ? 1 : 0));
  }
  return static_cast<std::uint8_t>((address & 0x7F) | (busy ? 0x80 : 0));
}
[[nodiscard]] constexpr std::uint8_t address_from_wire(const Profile& profile, std::uint8_t field) {
  return profile.memory_address_order == FieldOrder::document ? static_cast<std::uint8_t>(field >> 1) : field & 0x7F;
}
[[nodiscard]] constexpr bool busy_from_wire(const Profile& profile, std::uint8_t field) {
  return (field & (profile.memory_address_order == FieldOrder::document ? 0x01 : 0x80)) != 0;
}

}  // namespace detail

[[nodiscard]] constexpr std::size_t request_length(const Profile& profile, DataId id) {
  if (id == DataId::write_memory) return 4;
  if (id == DataId::read_memory) return 3;
  return profile.request_crc ? 2 : 1;
}

[[nodiscard]] constexpr RequestBytes encode_request(const Profile& profile, const Request& request) {
  RequestBytes bytes;
  bytes.push_back(control_field(profile, request.encoder_address, request.id));
  if (is_memory_access(request.id)) {
    bytes.push_back(detail::address_to_wire(profile, request.memory_address, false));
    if (request.id == DataId::write_memory) bytes.push_back(request.value);
  }
  if (bytes.size() < request_length(profile, request.id)) bytes.push_back(checksum8(profile.crc_bit_order, bytes));
  return bytes;
}

/// Errors: wrong_length; unsupported (an id that Table 3 does not list); bad_checksum (parity or CRC); out_of_range
/// (the busy bit is 0 in requests).
[[nodiscard]] constexpr Result<Request> decode_request(const Profile& profile, Bytes bytes) {
  if (bytes.empty()) return Error::wrong_length;
  const std::optional<DataId> id = data_id(bytes[0]);
  if (!id) return Error::unsupported;
  if (bytes.size() != request_length(profile, *id)) return Error::wrong_length;
  if (bytes.size() > 1 && checksum8(profile.crc_bit_order, bytes.first(bytes.size() - 1)) != bytes.back()) {
    return Error::bad_checksum;
  }
  Request request{*id, address_of(bytes[0])};
  if (bytes[0] != control_field(profile, request.encoder_address, *id)) return Error::bad_checksum;
  if (!is_memory_access(*id)) return request;
  if (detail::busy_from_wire(profile, bytes[1])) return Error::out_of_range;
  request.memory_address = detail::address_from_wire(profile, bytes[1]);
  if (*id == DataId::write_memory) request.value = bytes[2];
  return request;
}

namespace detail {

// {RS1, SC2}, or {0, SC2}.
constexpr std::uint8_t join(RedundantBit order, unsigned bit, unsigned counter) {
  counter &= 0x7F;
  return static_cast<std::uint8_t>(order == RedundantBit::b7 ? bit << 7 | counter : counter << 1 | bit);
}
constexpr unsigned redundant_bit(RedundantBit order, std::uint8_t byte) {
  return order == RedundantBit::b7 ? byte >> 7 : byte & 1u;
}
constexpr std::uint8_t counter_bits(RedundantBit order, std::uint8_t byte) {
  return order == RedundantBit::b7 ? byte & 0x7F : static_cast<std::uint8_t>(byte >> 1);
}

constexpr void encode_part(const Profile& profile, Part part, const Reply& reply, const ChannelReply& channel,
                           ReplyBytes& bytes) {
  const auto put = [&bytes](std::uint64_t value) { bytes.push_back(static_cast<std::uint8_t>(value)); };
  switch (part) {
    case Part::status:
      return put(status_to_wire(profile, channel.status));
    case Part::alarms:
      return put(channel.alarms);
    case Part::singleturn:
      for (unsigned i = 0; i < 24; i += 8) put(reply.singleturn >> i);
      return;
    case Part::multiturn:
      put(reply.multiturn);
      return put(reply.multiturn >> 8);
    case Part::sequence:
      return put(channel.sequence);
    case Part::encoder_id:
      return put(channel.encoder_id);
    case Part::temperature:
      return put(reply.temperature);
    case Part::redundant_sequence:
      put(reply.redundant >> 1);
      return put(join(profile.rs1_sc2, reply.redundant & 1, channel.sequence));
    case Part::zero_sequence:
      return put(join(profile.rs1_sc2, 0, channel.sequence));
    case Part::redundant_alone:
      put(reply.redundant >> 1);
      return put((reply.redundant & 1u) << (profile.idc_rs1 == RedundantBit::b7 ? 7 : 0));
    case Part::redundant_calibration:
      if (profile.id6_rs == Id6Redundant::bits_16) {
        put(reply.redundant >> 8);
        return put(reply.redundant);
      }
      put(reply.redundant >> 1);
      return put(reply.redundant & 1u);
    case Part::memory_address:
      return put(address_to_wire(profile, reply.memory_address, reply.busy));
    case Part::value:
      return put(reply.value);
  }
}

constexpr void encode_channel(const Profile& profile, const Reply& reply, std::uint8_t field, Channel number,
                              ReplyBytes& bytes) {
  const Layout& layout = layout_of(reply.id);
  const bool first = number == Channel::one;
  const std::size_t begin = bytes.size();
  bytes.push_back(field);
  for (const Part part : first ? layout.one() : layout.two()) {
    encode_part(profile, part, reply, first ? reply.one : reply.two, bytes);
  }
  const Bytes covered = bytes.view().subspan(begin);
  if (layout.crc_bytes == 1) {
    bytes.push_back(checksum8(profile.crc_bit_order, covered));
    return;
  }
  const std::uint16_t crc = checksum16(profile.crc_bit_order, number, covered);
  const bool low_first = low_byte_first(profile.crc16_byte_order, number);
  bytes.push_back(static_cast<std::uint8_t>(low_first ? crc : crc >> 8));
  bytes.push_back(static_cast<std::uint8_t>(low_first ? crc >> 8 : crc));
}

}  // namespace detail

/// With this control field: CF is that of the request, also where its parity is wrong.
[[nodiscard]] constexpr ReplyBytes encode_reply(const Profile& profile, const Reply& reply, std::uint8_t field) {
  ReplyBytes bytes;
  detail::encode_channel(profile, reply, field, Channel::one, bytes);
  if (layout_of(reply.id).has_two()) detail::encode_channel(profile, reply, field, Channel::two, bytes);
  return bytes;
}

[[nodiscard]] constexpr ReplyBytes encode_reply(const Profile& profile, const Reply& reply) {
  return encode_reply(profile, reply, control_field(profile, reply.encoder_address, reply.id));
}

}  // namespace absenc::esl
