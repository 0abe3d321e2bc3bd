// SPDX-License-Identifier: Apache-2.0
// Decoding an ESL reply: every check that the frame allows, in the order of check.hpp; and the reading it makes.
#pragma once

#include "absenc/protocol/esl/frame.hpp"

namespace absenc::esl {

namespace detail {

constexpr void decode_part(const Profile& profile, Part part, Bytes bytes, Reply& reply, ChannelReply& channel) {
  const std::uint8_t first = bytes[0];
  switch (part) {
    case Part::status:
      channel.status = status_from_wire(profile, first);
      break;
    case Part::alarms:
      channel.alarms = first;
      break;
    case Part::singleturn:
      reply.singleturn = first | static_cast<std::uint32_t>(bytes[1]) << 8 | static_cast<std::uint32_t>(bytes[2]) << 16;
      break;
    case Part::multiturn:
      reply.multiturn = static_cast<std::uint16_t>(first | bytes[1] << 8);
      break;
    case Part::sequence:
      channel.sequence = first;
      break;
    case Part::encoder_id:
      channel.encoder_id = first;
      break;
    case Part::temperature:
      reply.temperature = first;
      break;
    case Part::redundant_sequence:
      reply.redundant = static_cast<std::uint16_t>(unsigned{first} << 1 | redundant_bit(profile.rs1_sc2, bytes[1]));
      channel.sequence = counter_bits(profile.rs1_sc2, bytes[1]);
      break;
    case Part::zero_sequence:
      reply.unused_bits |= redundant_bit(profile.rs1_sc2, first) != 0;
      channel.sequence = counter_bits(profile.rs1_sc2, first);
      break;
    case Part::redundant_alone:
      reply.redundant = static_cast<std::uint16_t>(unsigned{first} << 1 | redundant_bit(profile.idc_rs1, bytes[1]));
      reply.unused_bits |= counter_bits(profile.idc_rs1, bytes[1]) != 0;
      break;
    case Part::redundant_calibration:
      if (profile.id6_rs == Id6Redundant::bits_16) {
        reply.redundant = static_cast<std::uint16_t>(first << 8 | bytes[1]);
      } else {
        reply.redundant = static_cast<std::uint16_t>(first << 1 | (bytes[1] & 1));
        reply.unused_bits |= bytes[1] > 1;
      }
      break;
    case Part::memory_address:
      reply.memory_address = address_from_wire(profile, first);
      reply.busy = busy_from_wire(profile, first);
      break;
    case Part::value:
      reply.value = first;
      break;
  }
}

constexpr void decode_channel(const Profile& profile, std::span<const Part> parts, Bytes bytes, Reply& reply,
                              ChannelReply& channel) {
  std::size_t at = 1;
  for (const Part part : parts) {
    decode_part(profile, part, bytes.subspan(at), reply, channel);
    at += size_of(part);
  }
}

constexpr bool checksum_holds(const Profile& profile, std::size_t crc_bytes, Channel channel, Bytes bytes) {
  const Bytes covered = bytes.first(bytes.size() - crc_bytes);
  if (crc_bytes == 1) return checksum8(profile.crc_bit_order, covered) == bytes.back();
  const Bytes sent = bytes.subspan(covered.size());
  const bool low_first = low_byte_first(profile.crc16_byte_order, channel);
  return checksum16(profile.crc_bit_order, channel, covered) ==
         (low_first ? load_little_endian(sent) : load_big_endian(sent));
}

constexpr Check check_checksums(const Profile& profile, const Layout& layout, Bytes one, Bytes two) {
  const bool one_holds = checksum_holds(profile, layout.crc_bytes, Channel::one, one);
  const bool two_holds = two.empty() || checksum_holds(profile, layout.crc_bytes, Channel::two, two);
  if (one_holds && two_holds) return Check::passed;
  if (two.empty()) return Check::both_checksums;
  if (one_holds) return Check::ch2_checksum;
  if (two_holds) return Check::ch1_checksum;
  // Channel 2 in front of channel 1?
  const Bytes all(one.data(), one.size() + two.size());
  const bool swapped = checksum_holds(profile, layout.crc_bytes, Channel::two, all.first(two.size())) &&
                       checksum_holds(profile, layout.crc_bytes, Channel::one, all.subspan(two.size()));
  return swapped ? Check::channels_swapped : Check::both_checksums;
}

constexpr Check check_echo(std::uint8_t asked, std::uint8_t one, std::uint8_t two) {
  if (address_of(one) != address_of(asked)) return Check::other_address;
  if (one != asked) return Check::other_command;
  return two == asked ? Check::passed : Check::ch2_other_request;
}

constexpr Check check_memory(const Request& request, const Reply& reply) {
  if (reply.memory_address != request.memory_address) return Check::other_memory_address;
  // Table 10: a busy encoder answers 00, an accepted write echoes its value.
  if (reply.busy) return reply.value == 0 ? Check::passed : Check::busy_with_data;
  return reply.id == DataId::write_memory && reply.value != request.value ? Check::other_value : Check::passed;
}

/// The redundant position in the 9 bits of IDs 1, 2, B, C.
constexpr unsigned redundant_9(const Profile& profile, const Reply& reply) {
  const bool wide = reply.id == DataId::calibration && profile.id6_rs == Id6Redundant::bits_16;
  return wide ? reply.redundant >> 7 : reply.redundant;
}

constexpr Check check_content(const Profile& profile, const Layout& layout, const Reply& reply) {
  const unsigned both = reply.one.status | reply.two.status;
  if ((both & status::parity_error) != 0) return Check::parity_reported;
  if ((both & status::stop_error) != 0) return Check::stop_reported;
  if ((reply.one.status & status::channel_2) != 0) return Check::ch1_channel_bit;
  if (!layout.has_two()) return Check::passed;
  if ((reply.two.status & status::channel_2) == 0) return Check::ch2_channel_bit;
  if (reply.unused_bits) return Check::unused_bits;
  if (layout.crc_bytes == 2 && (reply.one.sequence & 0x7F) != reply.two.sequence) return Check::sequences_differ;
  if (reply.one.encoder_id != reply.two.encoder_id) return Check::encoder_ids_differ;
  if (layout.parts_two[layout.count_two - 1] == Part::alarms || reply.id == DataId::encoder_id) return Check::passed;
  const std::int64_t off = wrapped_difference(redundant_9(profile, reply), reply.singleturn >> 15, redundant_bits);
  return (off < 0 ? -off : off) <= profile.redundant_tolerance ? Check::passed : Check::redundant_position;
}

}  // namespace detail

/// Checks in this order: length, checksums, echo, refusal, fixed bits, range, cross checks. `reply` is filled as soon
/// as the checksums hold, and to be used only when the result is `passed`. A busy memory reply passes.
[[nodiscard]] constexpr Check check_reply(const Profile& profile, const Request& request, Bytes bytes, Reply& reply) {
  const Layout& layout = layout_of(request.id);
  if (bytes.size() != layout.length_one + layout.length_two) {
    const bool first_only = layout.has_two() && bytes.size() == layout.length_one;
    return first_only && detail::checksum_holds(profile, layout.crc_bytes, Channel::one, bytes)
               ? Check::channel_2_missing
               : Check::length;
  }
  const Bytes one = bytes.first(layout.length_one);
  const Bytes two = bytes.subspan(layout.length_one);
  const Check sums = detail::check_checksums(profile, layout, one, two);
  if (sums != Check::passed) return sums;
  reply.id = request.id;
  reply.encoder_address = address_of(one[0]);
  detail::decode_channel(profile, layout.one(), one, reply, reply.one);
  if (layout.has_two()) detail::decode_channel(profile, layout.two(), two, reply, reply.two);
  const std::uint8_t asked = control_field(profile, request.encoder_address, request.id);
  const Check echo = detail::check_echo(asked, one[0], layout.has_two() ? two[0] : asked);
  if (echo != Check::passed) return echo;
  return is_memory_access(request.id) ? detail::check_memory(request, reply)
                                      : detail::check_content(profile, layout, reply);
}

[[nodiscard]] constexpr Result<Reply> decode_reply(const Profile& profile, const Request& request, Bytes bytes) {
  Reply reply;
  const Check check = check_reply(profile, request, bytes, reply);
  if (check != Check::passed) return error_of(check);
  return reply;
}

/// The position in a good reply and what of it holds, the flags of channel 2 above those of channel 1. IDs 4, 5 and 6
/// carry no alarms: SF alone tells then. This is not a safe position (safety.hpp).
[[nodiscard]] constexpr Reading to_reading(const Reply& reply) {
  const Layout& layout = layout_of(reply.id);
  const auto status = static_cast<std::uint8_t>(reply.one.status | (layout.has_two() ? reply.two.status : 0));
  const auto raised = static_cast<std::uint8_t>(reply.one.alarms | reply.two.alarms);
  Reading reading;
  reading.status = reply.one.status | (layout.has_two() ? static_cast<std::uint32_t>(reply.two.status) << 8 : 0);
  reading.alarms = reply.one.alarms | static_cast<std::uint32_t>(reply.two.alarms) << 8;
  reading.ready =
      (reply.one.status & status::ready) != 0 && (!layout.has_two() || (reply.two.status & status::ready) != 0);
  if (layout.has(Part::singleturn)) {
    const bool valid = reading.ready && (status & status::safety_error) == 0 && (raised & alarms::unsafe) == 0;
    reading.singleturn = reply.singleturn;
    reading.singleturn_bits = singleturn_bits;
    reading.singleturn_valid_bits = valid ? singleturn_bits : 0;
  }
  if (layout.has(Part::multiturn)) {
    const bool wrong =
        layout.has(Part::alarms) ? (raised & alarms::turns_wrong) != 0 : (status & status::non_safety_error) != 0;
    reading.multiturn = reply.multiturn;
    reading.multiturn_bits = multiturn_bits;
    reading.multiturn_valid = reading.ready && !wrong;
  }
  return reading;
}

}  // namespace absenc::esl
