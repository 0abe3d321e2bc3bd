// SPDX-License-Identifier: Apache-2.0
// Decodes and checks ESL requests and replies. The class Protocol has the functions that absenc/protocol/author
// requires.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absenc/core/angle.hpp"
#include "absenc/protocol/author/in_a_row.hpp"
#include "absenc/protocol/author/known.hpp"
#include "absenc/protocol/esl/frame.hpp"
#include "absenc/protocol/esl/timing.hpp"

namespace absenc::esl {

/// The first check that a reply failed; `passed` if it failed none.
enum class Check : std::uint8_t {
  passed,
  // Checks that are made for every reply.
  length,
  channel_2_missing,
  ch1_checksum,
  ch2_checksum,
  both_checksums,
  channels_swapped,
  other_address,
  other_command,
  ch2_other_request,
  other_memory_address,
  parity_reported,
  stop_reported,
  ch1_channel_bit,
  ch2_channel_bit,
  unused_bits,
  turns_of_one,
  busy_with_data,
  other_value,
  sequences_differ,
  redundant_position,
  encoder_ids_differ,
  // Checks that are made for a safe position only.
  not_a_safety_reply,
  ch1_not_ready,
  ch2_not_ready,
  forced_test_missing,
  safety_error,
  alarm,
  sequence_unknown,
  sequence_still,
  sequence_jumped,
  // Check that only `probe` (probe.hpp) reports: whether an encoder accepts the request.
  request_not_accepted,
};

/// Error and texts that report a failed check.
struct CheckText {
  Error error;                ///< Error that the failed check gives.
  std::string_view sentence;  ///< Sentence that states the flaw of the reply.
  std::string_view advice{};  ///< Advice that replaces the general advice for the error; empty: it is not replaced.
};

/// Error and texts of each check, in the order of Check.
inline constexpr std::array<CheckText, 32> check_texts{{
    {Error::none, ""},
    {Error::wrong_length, "the number of bytes is not that of this reply"},
    {Error::wrong_length, "channel 2 is missing: the reply ends after channel 1"},
    {Error::bad_checksum, "the CRC of channel 1 is wrong, channel 2 is good: nothing of the reply is used"},
    {Error::bad_checksum, "the CRC of channel 2 is wrong, channel 1 is good: nothing of the reply is used"},
    {Error::bad_checksum, "the CRC of a channel is wrong"},
    {Error::bad_checksum, "the channels are swapped: channel 2 came first"},
    {Error::unexpected_reply, "the control field carries the address of another encoder"},
    {Error::unexpected_reply, "the control field is that of another request"},
    {Error::unexpected_reply, "the control field of channel 2 is not that of the request"},
    {Error::unexpected_reply, "the reply is for another memory address"},
    {Error::request_rejected, "the encoder saw a wrong parity bit in the request and did not execute it"},
    {Error::request_rejected, "the encoder saw a wrong stop bit in the request and did not execute it"},
    {Error::unexpected_reply, "channel 1 says that it is channel 2"},
    {Error::unexpected_reply, "channel 2 says that it is channel 1"},
    {Error::out_of_range, "a bit that is always 0 is set"},
    {Error::out_of_range, "turns came from an encoder of one turn (turns=false)"},
    {Error::unexpected_reply, "the encoder is busy but sends data (Table 10: 00)"},
    {Error::unexpected_reply, "the encoder accepted another value than was sent"},
    {Error::sequence_mismatch, "the sequence counters of the two channels differ"},
    {Error::cross_check_failed, "the redundant position of channel 2 does not agree with channel 1"},
    {Error::cross_check_failed, "the two channels send different encoder ids"},
    {Error::unsupported, "only replies to IDs 1 and 2 can make a safe position"},
    {Error::busy, "channel 1 is not ready"},
    {Error::busy, "channel 2 is not ready"},
    {Error::request_rejected, "the forced test has not passed in both channels",
     "let the drive run the forced test, or set require_forced_test=false where the encoder has none"},
    {Error::request_rejected, "a channel reports a safety error", read_the_alarms},
    {Error::request_rejected, "a channel raises an alarm that makes the position unsafe", read_the_alarms},
    {Error::sequence_mismatch, "no earlier reply to another ID is known, so the sequence counter proves nothing yet"},
    {Error::sequence_mismatch, "the sequence counter stands still: this reply was seen before"},
    {Error::sequence_mismatch, "the sequence counter did not move as it should: a reply was repeated, lost or delayed"},
    {Error::unexpected_reply, "an encoder of this profile would not have answered the request as it did"},
}};
static_assert(check_texts.size() == static_cast<std::size_t>(Check::request_not_accepted) + 1);

/// Error of each check, apart from the texts, so that firmware does not link them.
inline constexpr std::array<Error, check_texts.size()> check_errors = [] {
  std::array<Error, check_texts.size()> errors{};
  for (std::size_t i = 0; i < errors.size(); ++i) errors[i] = check_texts[i].error;
  return errors;
}();

/// Returns the error and texts of a failed check.
[[nodiscard]] constexpr const CheckText& text_of(Check check) { return check_texts[static_cast<std::size_t>(check)]; }
/// Returns the error that a failed check gives; none for `passed`.
[[nodiscard]] constexpr Error error_of(Check check) { return check_errors[static_cast<std::size_t>(check)]; }

namespace detail {
// Returns the content of `bytes`, a request or a reply that echoes one, without checking it.
constexpr Request split_request(const Profile& profile, DataId id, Bytes bytes, bool& busy) {
  Request request{id, address_of(bytes[0])};
  if (!is_memory_access(id) || bytes.size() < 3) return request;
  const std::uint8_t field = from_wire(profile.memory_address_order == FieldOrder::document, bytes[1]);
  busy = (field & 0x80) != 0;
  request.memory_address = field & 0x7F;
  if (id == DataId::write_memory) request.value = bytes[2];
  return request;
}
}  // namespace detail

/// Returns whether the last of `bytes` is the 8-bit CRC of the bytes before it.
[[nodiscard]] constexpr bool has_checksum8(const Profile& profile, Bytes bytes) {
  return checksum8(profile.crc_bit_order, bytes.first(bytes.size() - 1)) == bytes.back();
}

/// Decodes a request. Errors: wrong_length, unsupported, bad_checksum, out_of_range.
[[nodiscard]] constexpr Result<Request> decode_request(const Profile& profile, Bytes bytes) {
  if (bytes.empty()) return Error::wrong_length;
  const std::optional<DataId> id = data_id(bytes[0]);
  if (!id) return Error::unsupported;
  if (bytes.size() != request_length(profile, *id)) return Error::wrong_length;
  if (bytes.size() > 1 && !has_checksum8(profile, bytes)) return Error::bad_checksum;
  if (bytes[0] != control_field(profile, address_of(bytes[0]), *id)) return Error::bad_checksum;
  bool busy = false;
  const Request request = detail::split_request(profile, *id, bytes, busy);
  return busy ? Result<Request>(Error::out_of_range) : request;
}

namespace detail {

// Decodes the redundant position (RS) from two bytes; returns the other seven bits of the second byte.
constexpr std::uint8_t split_redundant(RedundantBit order, Bytes bytes, Reply& reply) {
  const std::uint8_t second = from_wire(order == RedundantBit::b0, bytes[1]);
  reply.redundant = static_cast<std::uint16_t>(bytes[0] << 1 | second >> 7);
  return second & 0x7F;
}

template <unsigned id>
constexpr void part_from_wire(const Profile& profile, Bytes here, Reply& reply, ChannelReply& channel) {
  if constexpr (id == part::status) channel.status = status_from_wire(profile, here[0]);
  if constexpr (id == part::alarms) channel.alarms = here[0];
  if constexpr (id == part::singleturn) reply.singleturn = static_cast<std::uint32_t>(load_little_endian(here));
  if constexpr (id == part::multiturn) reply.multiturn = static_cast<std::uint16_t>(here[0] | here[1] << 8);
  if constexpr (id == part::encoder_id) channel.encoder_id = here[0];
  if constexpr (id == part::temperature) reply.temperature = static_cast<std::int8_t>(here[0]);
  if constexpr (id == part::sequence) channel.sequence = here[0];
  if constexpr (id == part::zero_sequence) {
    const std::uint8_t byte = from_wire(profile.rs1_sc2 == RedundantBit::b0, here[0]);
    reply.unused_bits |= (byte & 0x80) != 0;
    channel.sequence = byte & 0x7F;
  }
  if constexpr (id == part::redundant_sequence) channel.sequence = split_redundant(profile.rs1_sc2, here, reply);
  if constexpr (id == part::redundant_alone) {
    reply.unused_bits |= split_redundant(profile.idc_rs1, here, reply) != 0;
  }
  if constexpr (id == part::redundant_calibration) {
    if (profile.id6_rs == Id6Redundant::bits_16) {
      reply.redundant = static_cast<std::uint16_t>(here[0] << 8 | here[1]);
    } else {
      reply.unused_bits |= split_redundant(RedundantBit::b0, here, reply) != 0;
    }
  }
  if constexpr (id == part::memory_address) {
    const std::uint8_t field = from_wire(profile.memory_address_order == FieldOrder::document, here[0]);
    reply.memory_address = field & 0x7F;
    reply.busy = (field & 0x80) != 0;
  }
  if constexpr (id == part::value) reply.value = here[0];
}

constexpr void decode_parts(const Profile& profile, unsigned parts, Bytes bytes, Reply& reply, ChannelReply& channel) {
  walk_parts(parts, 0, [&]<class Part>(Part, std::size_t byte) {
    part_from_wire<Part::id>(profile, bytes.subspan(byte, Part::size), reply, channel);
  });
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
  // Both CRCs may be wrong because channel 2 was sent before channel 1.
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
  // Table 10: a busy encoder replies with the value 00; the reply to an accepted write echoes the written value.
  if (reply.busy) return reply.value == 0 ? Check::passed : Check::busy_with_data;
  return reply.id == DataId::write_memory && reply.value != request.value ? Check::other_value : Check::passed;
}

constexpr Check check_content(const Profile& profile, const Layout& layout, const Reply& reply) {
  const unsigned both = reply.one.status | reply.two.status;
  if ((both & status::parity_error) != 0) return Check::parity_reported;
  if ((both & status::stop_error) != 0) return Check::stop_reported;
  if ((reply.one.status & status::channel_2) != 0) return Check::ch1_channel_bit;
  if (!profile.turns && reply.multiturn != 0) return Check::turns_of_one;
  if (!layout.has_two()) return Check::passed;
  if ((reply.two.status & status::channel_2) == 0) return Check::ch2_channel_bit;
  if (reply.unused_bits) return Check::unused_bits;
  if (layout.crc_bytes == 2 && (reply.one.sequence & 0x7F) != reply.two.sequence) return Check::sequences_differ;
  if (reply.one.encoder_id != reply.two.encoder_id) return Check::encoder_ids_differ;
  if (!layout.has(part::redundant)) return Check::passed;
  const bool wide = layout.has(part::redundant_calibration) && profile.id6_rs == Id6Redundant::bits_16;
  const unsigned redundant = wide ? reply.redundant >> 7 : reply.redundant;
  const std::int64_t off = wrapped_difference(redundant, reply.singleturn >> 15, redundant_bits);
  return (off < 0 ? -off : off) <= profile.redundant_tolerance ? Check::passed : Check::redundant_position;
}

}  // namespace detail

namespace detail {
// Checks and decodes a reply to `request`. `asked`: control field of the request as sent, even with a wrong parity bit.
constexpr Check check_reply_to(const Profile& profile, const Request& request, std::uint8_t asked, Bytes bytes,
                               Reply& reply) {
  const Layout& layout = layout_of(request.id);
  if (bytes.size() != reply_length(request.id)) {
    const bool first_only = layout.has_two() && bytes.size() == layout.length_one;
    return first_only && checksum_holds(profile, layout.crc_bytes, Channel::one, bytes) ? Check::channel_2_missing
                                                                                        : Check::length;
  }
  const Bytes one = bytes.first(layout.length_one);
  const Bytes two = bytes.subspan(layout.length_one);
  const Check sums = check_checksums(profile, layout, one, two);
  if (sums != Check::passed) return sums;
  reply.id = request.id;
  reply.encoder_address = address_of(one[0]);
  decode_parts(profile, layout.one, one, reply, reply.one);
  if (layout.has_two()) decode_parts(profile, layout.two, two, reply, reply.two);
  const Check echo = check_echo(asked, one[0], layout.has_two() ? two[0] : asked);
  if (echo != Check::passed) return echo;
  return is_memory_access(request.id) ? check_memory(request, reply) : check_content(profile, layout, reply);
}
}  // namespace detail

/// Checks and decodes a reply. Returns the first check that failed; use `reply` only if it is `passed`.
[[nodiscard]] constexpr Check check_reply(const Profile& profile, const Request& request, Bytes bytes, Reply& reply) {
  const std::uint8_t asked = control_field(profile, request.encoder_address, request.id);
  return detail::check_reply_to(profile, request, asked, bytes, reply);
}

/// Returns the refusal that a reply states, if the request has a wrong parity bit and no other error; otherwise
/// `passed`.
[[nodiscard]] constexpr Check check_refusal(const Profile& profile, Bytes request, Bytes bytes) {
  if (bytes.empty()) return Check::passed;
  const Bytes sent = request.empty() ? bytes : request;
  const std::optional<DataId> id = data_id(sent[0]);
  if (!id || sent[0] == control_field(profile, address_of(sent[0]), *id)) return Check::passed;
  const bool whole = request.empty() || request.size() == request_length(profile, *id);
  if (!whole || (request.size() > 1 && !has_checksum8(profile, request))) return Check::passed;
  bool busy = false;
  Reply reply;
  const Check check =
      detail::check_reply_to(profile, detail::split_request(profile, *id, sent, busy), sent[0], bytes, reply);
  return error_of(check) == Error::request_rejected ? check : Check::passed;
}

/// Checks and decodes a reply. Returns the reply, or the error of the first failed check.
[[nodiscard]] constexpr Result<Reply> decode_reply(const Profile& profile, const Request& request, Bytes bytes) {
  Result<Reply> result;
  const Error error = error_of(check_reply(profile, request, bytes, *result));
  if (error != Error::none) result = error;
  return result;
}

namespace detail {
// Returns the alarms of a channel that make its position unsafe. If the status has only non_safety_error, the Lissajous
// signals caused led_or_lissajous_error (Table 5), which is then not unsafe.
constexpr unsigned unsafe_alarms(const ChannelReply& channel) {
  constexpr std::uint8_t errors = status::safety_error | status::non_safety_error;
  const bool lissajous = (channel.status & errors) == status::non_safety_error;
  return channel.alarms & alarms::unsafe & ~(lissajous ? unsigned{alarms::led_or_lissajous_error} : 0u);
}
}  // namespace detail

/// Returns the position and turns of a valid reply to data ID `id`; they are not a safe position (safety.hpp). In
/// status and alarms of the reading, the flags of channel 2 are above those of channel 1.
[[nodiscard]] constexpr Reading to_reading(DataId id, const Reply& reply) {
  const Layout& layout = layout_of(id);
  const std::uint8_t second = layout.has_two() ? reply.two.status : reply.one.status;
  const unsigned either = reply.one.status | second;
  const unsigned raised = reply.one.alarms | reply.two.alarms;
  Reading reading;
  reading.status = reply.one.status | (layout.has_two() ? std::uint32_t{second} << 8 : 0);
  reading.alarms = reply.one.alarms | std::uint32_t{reply.two.alarms} << 8;
  reading.status_reported = (layout.has(part::status) ? 0xFFu : 0u) | (layout.has_two() ? 0xFF00u : 0u);
  reading.alarms_reported =
      ((layout.one & part::alarms) != 0 ? 0xFFu : 0u) | ((layout.two & part::alarms) != 0 ? 0xFF00u : 0u);
  reading.ready = (reply.one.status & second & status::ready) != 0;
  if (layout.has(part::singleturn)) {
    const bool valid = reading.ready && (either & status::safety_error) == 0 &&
                       (detail::unsafe_alarms(reply.one) | detail::unsafe_alarms(reply.two)) == 0;
    reading.singleturn = reply.singleturn;
    reading.singleturn_bits = singleturn_bits;
    reading.singleturn_valid_bits = valid ? singleturn_bits : 0;
  }
  if (layout.has(part::multiturn)) {
    const bool told = layout.has(part::alarms) || (either & status::non_safety_error) == 0;
    reading.multiturn = reply.multiturn;
    reading.multiturn_bits = multiturn_bits;
    reading.multiturn_known = told || !reading.ready;
    reading.multiturn_valid = reading.ready && told && (raised & alarms::turns_wrong) == 0;
  }
  return reading;
}
/// Returns the position and turns of a valid reply; the reply's own data ID decides which it has.
[[nodiscard]] constexpr Reading to_reading(const Reply& reply) { return to_reading(reply.id, reply); }

// ---- Protocol, for author's engine

/// Returns whether a request selects a memory page.
[[nodiscard]] constexpr bool selects_page(const Request& request) {
  return request.id == DataId::write_memory && request.memory_address == page_select_address;
}

/// Rules for the requests of a reset (Table 4). Typical are 40 us from the start of one request to the start of the
/// next.
inline constexpr author::InARow reset_row{
    .requests = reset_requests,
    .interval = reset_interval,
    .between = author::InARow::IntervalBounds::requests,
    .accepted = 35us,
    .number_rule = "reset not sent eight times in a row",
    .interval_rule = "reset sent too fast: much less than 40 us after the one before",
};

/// The functions of ESL that the templates of absenc/protocol/author require.
struct Protocol {
  /// Format of the encoder: the values of its options.
  using Format = Profile;
  /// C++ type of the protocol's requests.
  using Request = esl::Request;
  /// C++ type of the protocol's replies.
  using Reply = esl::Reply;
  static constexpr std::size_t longest_reply = reply_capacity;  ///< Greatest length of a reply in bytes.

  /// Returns a host's timeouts and its pause between requests.
  static constexpr author::HostTimes host_times(const Profile&) {
    return {.answer_limit = answer_limit, .gap_limit = gap_limit, .pause = request_pause};
  }
  /// Returns how a request is sent and repeated; after memory requests the encoder may be busy.
  static constexpr author::Manner manner(const Profile&, const Request& request) {
    const Time busy = selects_page(request) ? page_time : is_memory_access(request.id) ? eeprom_read_pause : Time{};
    return {.pause = busy, .hold = busy};
  }
  /// Returns the length in bytes of the request that begins with `begin`; 0 if its parity bit or its data ID is wrong.
  static constexpr std::size_t request_size(const Profile& profile, Bytes begin) {
    const std::optional<DataId> id = data_id(begin[0]);
    if (!id || begin[0] != control_field(profile, address_of(begin[0]), *id)) return 0;
    return request_length(profile, *id);
  }
  /// Returns the length in bytes of the reply to `request`.
  static constexpr std::size_t reply_size(const Profile&, const Request& request) { return reply_length(request.id); }
  static constexpr auto encode = encode_request;  ///< returns the bytes of a request
  /// Decodes a request; returns the request, or the error of the first failed check.
  static constexpr auto decode_request = esl::decode_request;
  /// Checks and decodes a reply. Returns the reply, or the error of the first failed check.
  static constexpr auto decode = decode_reply;
  /// Returns the position and turns of a valid reply; no turns if the profile's encoder counts none.
  static constexpr Reading reading(const Profile& profile, const Request& request, const Reply& reply) {
    // The data ID is taken from the request instead of the reply, because the compiler may know the request.
    Reading reading = to_reading(request.id, reply);
    if (!profile.turns) reading.multiturn_bits = 0;
    if (!profile.turns) reading.multiturn_valid = false;
    return reading;
  }
  /// Returns the length in bytes of the reply to `request`.
  static constexpr std::size_t expected(const Profile& profile, const Request& request, Bytes) {
    return reply_size(profile, request);
  }
  /// Returns false: a reply with any error may be incomplete, so the host awaits more bytes.
  static constexpr bool is_whole(const Profile&, Error) { return false; }
  static constexpr auto latched = latch_time;  ///< returns the typical time at which the encoder latched the position
};

/// Conversation that reads a position with a constant profile and request.
template <const Profile& profile, const Request& request>
using ReadKnownPosition = author::ReadKnownPosition<Protocol, profile, request>;

}  // namespace absenc::esl
