// SPDX-License-Identifier: Apache-2.0
// Names, units and meanings of all values in an ESL frame, in words for the operator.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/author/bits.hpp"
#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/esl/reply.hpp"

namespace absenc::esl {

/// Descriptions of the bits of the status field (SF) of replies (Table 5), from bit 0 on.
inline constexpr std::array<FlagInfo, 8> status_flags{{
    {"parity_error", "the encoder received the request with a wrong parity bit and did not execute it",
     "send the same request again; if it stays, set parity_scope"},
    {"stop_error", "the encoder received the request with a wrong stop bit and did not execute it",
     "send the same request again; if it stays, check baud rate and termination"},
    {"safety_error", "single-turn, memory, supply voltage or LED: the position is not safe", read_the_alarms, false,
     alarms::unsafe},
    {"non_safety_error", "multi-turn, turn counting, Lissajous or overspeed", read_the_alarms, false,
     alarms::turns_wrong | alarms::led_or_lissajous_error | alarms::overspeed},
    {"temperature_warning", "the encoder is too warm",
     "improve the cooling; `absenc temperature` shows how warm it is"},
    {"channel_2", "this is channel 2", ""},
    {"ready", "the encoder is ready", ""},
    {"forced_test_passed", "the forced test has passed", ""},
}};

/// Descriptions of the bits of the alarm field (ALM) of a channel (Tables 7 and 8), from bit 0 on.
inline constexpr std::array<FlagInfo, 8> alarm_flags{{
    {"xc_error", "the turn counter missed five times in a row: turns may be wrong",
     "return to the origin, then `absenc clear-alarms`, and check the turns"},
    {"multiturn_error", "the turn counter was found wrong: turns are lost",
     "return to the origin, then `absenc reset-multiturn`, then `absenc clear-alarms`"},
    {"led_or_lissajous_error", "the LED current or the signals of the disc are out of range",
     "stop the drive; `absenc run ... led-or-lissajous` tells which; then switch the encoder off and on"},
    {"overspeed", "the shaft turned faster than 10 000 rpm", "slow down, then switch the encoder off and on"},
    {"memory_error", "the encoder could not load its own settings at power on",
     "stop the drive, switch the encoder off and on; replace it if the error stays"},
    {"singleturn_error", "the position within the turn was found wrong",
     "stop the drive at once, then switch the encoder off and on"},
    {"under_voltage", "the supply that the encoder makes inside is below its limit of 2.9 V",
     "check cable and plugs, and that 5 V are at the connector; it clears with the voltage"},
    {"over_voltage", "the supply that the encoder makes inside is above its limit of 3.7 V",
     "check that no more than 5 V are at the connector; it clears with the voltage, or the encoder is damaged"},
}};

/// Values of the fields of a frame, or of a procedure's result.
struct Shown {
  constexpr Shown() = default;
  /// Constructs the values of a request.
  constexpr Shown(const Profile& profile, const Request& request)
      : data_id(request.id),
        control_field(esl::control_field(profile, request.encoder_address, request.id)),
        encoder_address(request.encoder_address) {
    if (is_memory_access(request.id)) memory_address = request.memory_address;
    if (request.id == DataId::write_memory) value = request.value;
  }
  /// Constructs the values of a reply.
  constexpr explicit Shown(const Reply& one) { show(one); }

  /// Adds the values of a reply to those of the request.
  constexpr void show(const Reply& one) {
    data_id = one.id;
    encoder_address = one.encoder_address;
    reply = one;
    if (!is_memory_access(one.id)) return;
    memory_address = one.memory_address;
    busy = one.busy;
    value = one.value;
  }

  std::optional<DataId> data_id{};              ///< Data ID of the request or reply.
  std::optional<std::uint8_t> control_field{};  ///< Control field (CF) of a request: encoder address, data ID, parity.
  std::optional<std::uint8_t> encoder_address{};  ///< Address of the encoder on the line (EAD).
  std::optional<Reply> reply{};  ///< The decoded reply; its data ID decides which of its values are reported as fields.
  /// Scan: whether the last of three replies of the address `encoder_address` was damaged.
  std::optional<bool> clash{};
  /// Scan: sentence about the error in a complete reply of the address `encoder_address`.
  std::optional<std::string_view> trouble{};
  std::optional<std::uint8_t> page{};            ///< Page of the memory byte that is accessed.
  std::optional<std::uint8_t> memory_address{};  ///< Address of the memory byte that is accessed (ADF).
  std::optional<std::uint8_t> busy{};            ///< 1: the memory is busy; no byte was read or written.
  std::optional<std::uint8_t> value{};           ///< Value of the memory byte (EDF).
  std::optional<Bytes> data{};                   ///< Values of several memory bytes, from `memory_address` on.
  std::optional<bool> written{};          ///< True if the memory byte was written; false if it had the value already.
  std::optional<bool> led_error{};        ///< Whether the LED current is out of range.
  std::optional<bool> lissajous_error{};  ///< Whether the signals of the disc are out of range.
  std::optional<std::uint32_t> safe_singleturn{};  ///< Safe position within the turn, in counts.
  /// Memory page that a procedure leaves selected, if it may differ from the page selected before the procedure.
  std::optional<std::uint8_t> page_left{};
  bool has_turns = true;  ///< whether the turns (ABM) of the reply are reported as a field
};

namespace detail {
// Returns `member` of the reply if this channel of the reply carries `part`; otherwise no value.
template <Channel channel, unsigned part, auto member>
constexpr auto in(const Shown& all) {
  const Reply reply = all.reply.value_or(Reply{});
  const unsigned parts = channel == Channel::one ? layout_of(reply.id).one : layout_of(reply.id).two;
  const bool is_there = all.reply && (parts & part) != 0;
  if constexpr (requires { reply.*member; }) {
    return is_there ? std::optional(reply.*member) : std::nullopt;
  } else {
    return is_there ? std::optional((channel == Channel::one ? reply.one : reply.two).*member) : std::nullopt;
  }
}
constexpr std::optional<std::uint16_t> turns_in(const Shown& all) {
  return all.has_turns ? in<Channel::one, part::multiturn, &Reply::multiturn>(all) : std::nullopt;
}
// Returns the bits of the encoder id (ENID) that `shift` and `mask` select; the id is the same in both channels.
template <unsigned shift, unsigned mask>
constexpr std::optional<unsigned> of_encoder_id(const Shown& all) {
  const auto id = in<Channel::one, part::encoder_id, &ChannelReply::encoder_id>(all);
  return id ? std::optional(unsigned{*id} >> shift & mask) : std::nullopt;
}
}  // namespace detail

/// Table of the fields in which requests, replies and results of procedures are reported.
inline constexpr auto fields = [] {
  using author::field;
  using detail::in;
  using enum Channel;
  return author::fields_of<Shown>(
      field<&Shown::data_id>("data_id", "", "which data was asked for (Table 3)", Role::exchange),
      author::in_hex(
          field<&Shown::control_field>("control_field", "", "CF: encoder address, data id, parity", Role::exchange)),
      field<&Shown::encoder_address>("encoder_address", "", "which encoder on the line (EAD)", Role::encoder),
      field<&Shown::clash>("clash", "",
                           "yes: its answer is damaged every time; two encoders share the address, or the line is bad",
                           Role::clash),
      field<&Shown::trouble>("trouble", "", "why an answer that came whole is not good", Role::trouble),
      field<in<one, part::status, &ChannelReply::status>>("ch1_status", "status of channel 1 (SF)", status_flags),
      field<in<one, part::alarms, &ChannelReply::alarms>>("ch1_alarms", "alarms of channel 1 (ALM)", alarm_flags),
      field<in<one, part::singleturn, &Reply::singleturn>>("singleturn", "counts", "position within the turn (ABS)",
                                                           Role::position),
      field<detail::turns_in>("multiturn", "revolutions", "turns (ABM)", Role::turns),
      author::in_hex(field<in<one, part::encoder_id, &ChannelReply::encoder_id>>(
          "encoder_id", "", "D8 multi-turn, 98 single-turn (ENID)", Role::identity)),
      field<detail::of_encoder_id<7, 1>>("safety", "", "1: a safety encoder (ENID bit 7)"),
      field<detail::of_encoder_id<5, 3>>("multiturn_bytes", "", "of turns (ENID bits 6 and 5)"),
      field<detail::of_encoder_id<0, 0x1F>>("singleturn_bits", "",
                                            "of the position within the turn (ENID bits 4 to 0)"),
      field<in<one, part::sequence, &ChannelReply::sequence>>("ch1_sequence", "", "counts the replies, 0 to 255 (SC1)",
                                                              Role::sequence),
      field<in<one, part::temperature, &Reply::temperature>>("temperature_c", "degC", "inside the encoder"),
      field<in<two, part::status, &ChannelReply::status>>("ch2_status", "status of channel 2 (SF)", status_flags),
      field<in<two, part::alarms, &ChannelReply::alarms>>("ch2_alarms", "alarms of channel 2 (ALM)", alarm_flags),
      field<in<two, part::redundant, &Reply::redundant>>(
          "redundant_singleturn", "counts", "position of channel 2 in 9 bits, with ID 6 in 16 (RS)", Role::of_position),
      field<in<two, part::zero_sequence | part::redundant_sequence, &ChannelReply::sequence>>(
          "ch2_sequence", "", "counts the replies, 0 to 127 (SC2)", Role::sequence),
      field<&Shown::page>("page", "", "memory page"),
      field<&Shown::memory_address>("memory_address", "", "ADF: 0 to 126; 127 selects the page"),
      field<&Shown::busy>("busy", "", "1 while the memory is read or written: the request was not executed"),
      field<&Shown::value>("value", "", "EDF: the byte in memory", Role::value),
      field<&Shown::data>("data", "", "the bytes in memory from `memory_address` on", Role::data),
      field<&Shown::written>("written", "", "false when the value was there already", Role::written),
      field<&Shown::led_error>("led_error", "", "the LED current is out of its range"),
      field<&Shown::lissajous_error>("lissajous_error", "", "the signals of the disc are out of their range"),
      field<&Shown::safe_singleturn>("safe_singleturn", "counts",
                                     "the position, every check of a safety reader passed"),
      field<&Shown::page_left>(
          "page_left", "",
          "memory page that is left selected, also for whoever reads next: which one was before is not known"));
}();

namespace detail {
// Returns the bits of a reply that carry `field`, if the part `id` of the reply carries it; `here` is the index of the
// first byte of this part.
template <Channel channel, unsigned id>
constexpr BitRanges place_in_part(const Profile& profile, std::size_t here, const FieldInfo& field) {
  using author::bits_of;
  const auto is = [&field](const FieldInfo* one) { return one == &field; };
  // Returns the bits of the redundant position (RS): its lowest bit is in the second byte, the others are in the first.
  const auto redundant = [here](RedundantBit low) {
    BitRanges ranges = bits_of(here + 1, low == RedundantBit::b7 ? 7 : 0, 1);
    ranges.push_back({8 * here, 8});
    return ranges;
  };
  if constexpr (id == part::status) {
    if (!is(fields.of<in<channel, part::status, &ChannelReply::status>>())) return {};
    if (profile.status_order == FieldOrder::document) return bits_of(here, 0, 8);
    BitRanges ranges = bits_of(here, 6, 2);
    ranges.push_back({8 * here + 4, 2});
    ranges.push_back({8 * here, 4});
    return ranges;
  }
  if constexpr (id == part::alarms) {
    if (is(fields.of<in<channel, part::alarms, &ChannelReply::alarms>>())) return bits_of(here, 0, 8);
  }
  if constexpr (channel == Channel::one) {
    if constexpr (id == part::singleturn) {
      if (is(fields.of<in<channel, part::singleturn, &Reply::singleturn>>())) return bits_of(here, 0, singleturn_bits);
    }
    if constexpr (id == part::multiturn) {
      if (is(fields.of<turns_in>())) return bits_of(here, 0, multiturn_bits);
    }
    if constexpr (id == part::encoder_id) {
      if (is(fields.of<in<channel, part::encoder_id, &ChannelReply::encoder_id>>())) return bits_of(here, 0, 8);
      if (is(fields.of<of_encoder_id<7, 1>>())) return bits_of(here, 7, 1);
      if (is(fields.of<of_encoder_id<5, 3>>())) return bits_of(here, 5, 2);
      if (is(fields.of<of_encoder_id<0, 0x1F>>())) return bits_of(here, 0, 5);
    }
    if constexpr (id == part::temperature) {
      if (is(fields.of<in<channel, part::temperature, &Reply::temperature>>())) return bits_of(here, 0, 8);
    }
    if constexpr (id == part::sequence) {
      if (is(fields.of<in<channel, part::sequence, &ChannelReply::sequence>>())) return bits_of(here, 0, 8);
    }
    if constexpr (id == part::memory_address) {
      const bool as_document = profile.memory_address_order == FieldOrder::document;
      if (is(fields.of<&Shown::busy>())) return bits_of(here, as_document ? 0 : 7, 1);
      if (is(fields.of<&Shown::memory_address>())) return bits_of(here, as_document ? 1 : 0, 7);
    }
    if constexpr (id == part::value) {
      if (is(fields.of<&Shown::value>())) return bits_of(here, 0, 8);
    }
  } else {
    const std::size_t lowest = profile.rs1_sc2 == RedundantBit::b7 ? 0 : 1;
    const bool is_sequence =
        is(fields.of<in<channel, part::zero_sequence | part::redundant_sequence, &ChannelReply::sequence>>());
    const bool is_redundant = is(fields.of<in<channel, part::redundant, &Reply::redundant>>());
    if (id == part::zero_sequence && is_sequence) return bits_of(here, lowest, 7);
    if (id == part::redundant_sequence && is_sequence) return bits_of(here + 1, lowest, 7);
    if (id == part::redundant_sequence && is_redundant) return redundant(profile.rs1_sc2);
    if (id == part::redundant_alone && is_redundant) return redundant(profile.idc_rs1);
    if (id == part::redundant_calibration && is_redundant) {
      return profile.id6_rs == Id6Redundant::bits_16 ? author::big_endian_bits(here, 2, 16)
                                                     : redundant(RedundantBit::b0);
    }
  }
  return {};
}

template <Channel channel>
constexpr BitRanges place_in(const Profile& profile, unsigned parts, std::size_t control_field,
                             const FieldInfo& field) {
  BitRanges place;
  walk_parts(parts, control_field, [&]<class Part>(Part, std::size_t byte) {
    if (place.empty()) place = place_in_part<channel, Part::id>(profile, byte, field);
  });
  return place;
}
}  // namespace detail

/// Returns the bits of a valid reply that carry `field`; no bits if the field has no fixed place.
[[nodiscard]] constexpr BitRanges place_of(const Profile& profile, Bytes reply, const FieldInfo& field) {
  if (&field == fields.of<&Shown::encoder_address>()) return author::bits_of(0, 0, 3);
  if (&field == fields.of<&Shown::data_id>()) return author::bits_of(0, 3, 4);
  const Layout& layout = layout_of(data_id(reply[0]).value_or(DataId::position));
  const BitRanges place = detail::place_in<Channel::one>(profile, layout.one, 0, field);
  return !place.empty() || !layout.has_two()
             ? place
             : detail::place_in<Channel::two>(profile, layout.two, layout.length_one, field);
}

}  // namespace absenc::esl
