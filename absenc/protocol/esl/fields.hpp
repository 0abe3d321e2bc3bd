// SPDX-License-Identifier: Apache-2.0
// Names, units and meanings of everything in an ESL frame, in words for the person in front of the machine.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/author/bits.hpp"
#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/esl/reply.hpp"

namespace absenc::esl {

// Table 5
inline constexpr std::array<FlagInfo, 8> status_flags{{
    {"parity_error", "the encoder received the request with a wrong parity bit and did not execute it",
     "send the same request again; if it stays, set parity_scope"},
    {"stop_error", "the encoder received the request with a wrong stop bit and did not execute it",
     "send the same request again; if it stays, check baud rate and termination"},
    {"safety_error", "single-turn, memory, supply voltage or LED: the position is not safe", "read the alarms (ID A)"},
    {"non_safety_error", "multi-turn, turn counting, Lissajous or overspeed", "read the alarms (ID A)"},
    {"temperature_warning", "the encoder is too warm", "read the temperature, improve the cooling"},
    {"channel_2", "this is channel 2", ""},
    {"ready", "the encoder is ready", ""},
    {"forced_test_passed", "the forced test has passed", ""},
}};

// Tables 7 and 8
inline constexpr std::array<FlagInfo, 8> alarm_flags{{
    {"xc_error", "the turn counter missed five times in a row: turns may be wrong",
     "return to the origin, then clear-alarms and check the turns"},
    {"multiturn_error", "the turn counter was found wrong: turns are lost",
     "return to the origin, reset-multiturn, then clear-alarms"},
    {"led_or_lissajous_error", "the LED current or the signals of the disc are out of range",
     "stop the drive; led-or-lissajous tells which; then switch the encoder off and on"},
    {"overspeed", "the shaft turned faster than 10 000 rpm", "slow down, then switch the encoder off and on"},
    {"memory_error", "the encoder could not load its own settings at power on",
     "stop the drive, switch the encoder off and on; replace it if the error stays"},
    {"singleturn_error", "the position within the turn was found wrong",
     "stop the drive at once, then switch the encoder off and on"},
    {"under_voltage", "the supply is below 2.9 V", "check supply and cable; it clears with the voltage"},
    {"over_voltage", "the supply is above 3.7 V", "check the supply; it clears with the voltage"},
}};

/// Each is there where a frame or a command has it.
struct Values {
  std::optional<DataId> data_id{};
  std::optional<std::uint8_t> control_field{};
  std::optional<std::uint8_t> encoder_address{};
  std::optional<bool> clash{};
  std::optional<std::uint8_t> ch1_status{};
  std::optional<std::uint8_t> ch1_alarms{};
  std::optional<std::uint32_t> singleturn{};
  std::optional<std::uint16_t> multiturn{};
  std::optional<std::uint8_t> encoder_id{};
  std::optional<unsigned> safety{};
  std::optional<unsigned> multiturn_bytes{};
  std::optional<unsigned> singleturn_bits{};
  std::optional<std::uint8_t> ch1_sequence{};
  std::optional<std::int8_t> temperature{};  // its sign is assumed
  std::optional<std::uint8_t> ch2_status{};
  std::optional<std::uint8_t> ch2_alarms{};
  std::optional<std::uint16_t> redundant{};
  std::optional<std::uint8_t> ch2_sequence{};
  std::optional<std::uint8_t> page{};
  std::optional<std::uint8_t> memory_address{};
  std::optional<bool> busy{};
  std::optional<std::uint8_t> value{};
  std::optional<Bytes> data{};
  std::optional<bool> written{};
  std::optional<bool> led_error{};
  std::optional<bool> lissajous_error{};
  std::optional<std::uint32_t> safe_singleturn{};
  std::optional<std::uint8_t> page_left{};
};

using Kind = FieldInfo::Kind;
inline constexpr auto fields = author::fields_of<Values>(
    author::field<&Values::data_id>({"data_id", Kind::number, "", "which data was asked for (Table 3)"}),
    author::field<&Values::control_field>({"control_field", Kind::number, "", "CF: encoder address, data id, parity"}),
    author::field<&Values::encoder_address>(
        {"encoder_address", Kind::number, "", "EAD: which encoder on the line", {}, Role::encoder}),
    author::field<&Values::clash>(
        {"clash",
         Kind::boolean,
         "",
         "yes: its answer is damaged every time; two encoders share the address, or the line is bad",
         {},
         Role::clash}),
    author::field<&Values::ch1_status>({"ch1_status", Kind::flags, "", "SF of channel 1", status_flags}),
    author::field<&Values::ch1_alarms>({"ch1_alarms", Kind::flags, "", "ALM of channel 1", alarm_flags}),
    author::field<&Values::singleturn>(
        {"singleturn", Kind::number, "counts", "ABS: position within the turn", {}, Role::position}),
    author::field<&Values::multiturn>({"multiturn", Kind::number, "revolutions", "ABM", {}, Role::turns}),
    author::field<&Values::encoder_id>({"encoder_id", Kind::number, "", "ENID: D8 multi-turn, 98 single-turn"}),
    author::field<&Values::safety>({"safety", Kind::number, "", "1: a safety encoder (ENID bit 7)"}),
    author::field<&Values::multiturn_bytes>({"multiturn_bytes", Kind::number, "", "of turns (ENID bits 6 and 5)"}),
    author::field<&Values::singleturn_bits>(
        {"singleturn_bits", Kind::number, "", "of the position within the turn (ENID bits 4 to 0)"}),
    author::field<&Values::ch1_sequence>(
        {"ch1_sequence", Kind::number, "", "SC1: counts the replies, 0 to 255", {}, Role::sequence}),
    author::field<&Values::temperature>({"temperature_c", Kind::number, "degC", "inside the encoder"}),
    author::field<&Values::ch2_status>({"ch2_status", Kind::flags, "", "SF of channel 2", status_flags}),
    author::field<&Values::ch2_alarms>({"ch2_alarms", Kind::flags, "", "ALM of channel 2", alarm_flags}),
    author::field<&Values::redundant>({"redundant_singleturn",
                                       Kind::number,
                                       "counts",
                                       "RS: the position of channel 2, 9 bits (ID 6: 16)",
                                       {},
                                       Role::of_position}),
    author::field<&Values::ch2_sequence>(
        {"ch2_sequence", Kind::number, "", "SC2: counts the replies, 0 to 127", {}, Role::sequence}),
    author::field<&Values::page>({"page", Kind::number, "", "memory page"}),
    author::field<&Values::memory_address>({"memory_address", Kind::number, "", "ADF: 0 to 126; 127 selects the page"}),
    author::field<&Values::busy>(
        {"busy", Kind::number, "", "1 while the memory is read or written: the request was not executed"}),
    author::field<&Values::value>({"value", Kind::number, "", "EDF: the byte in memory", {}, Role::value}),
    author::field<&Values::data>(
        {"data", Kind::bytes, "", "the bytes in memory from `memory_address` on", {}, Role::data}),
    author::field<&Values::written>({"written", Kind::boolean, "", "false when the value was there already"}),
    author::field<&Values::led_error>({"led_error", Kind::boolean, "", "the LED current is out of its range"}),
    author::field<&Values::lissajous_error>(
        {"lissajous_error", Kind::boolean, "", "the signals of the disc are out of their range"}),
    author::field<&Values::safe_singleturn>(
        {"safe_singleturn", Kind::number, "counts", "the position, every check of a safety reader passed"}),
    author::field<&Values::page_left>(
        {"page_left", Kind::number, "",
         "memory page that is left selected, also for whoever reads next: which one was before is not known"}));

/// Every field that the request carries.
[[nodiscard]] constexpr Values values_of(const Profile& profile, const Request& request) {
  Values values{.data_id = request.id,
                .control_field = control_field(profile, request.encoder_address, request.id),
                .encoder_address = request.encoder_address};
  if (is_memory_access(request.id)) values.memory_address = request.memory_address;
  if (request.id == DataId::write_memory) values.value = request.value;
  return values;
}

namespace detail {

constexpr void put_part(Values& values, Part part, const Reply& reply, bool first) {
  const ChannelReply& channel = first ? reply.one : reply.two;
  switch (part) {
    case Part::status:
      (first ? values.ch1_status : values.ch2_status) = channel.status;
      break;
    case Part::alarms:
      (first ? values.ch1_alarms : values.ch2_alarms) = channel.alarms;
      break;
    case Part::singleturn:
      values.singleturn = reply.singleturn;
      break;
    case Part::multiturn:
      values.multiturn = reply.multiturn;
      break;
    case Part::sequence:
      values.ch1_sequence = channel.sequence;
      break;
    case Part::encoder_id:  // the same in both channels
      values.encoder_id = channel.encoder_id;
      values.safety = channel.encoder_id >> 7;
      values.multiturn_bytes = channel.encoder_id >> 5 & 3;
      values.singleturn_bits = channel.encoder_id & 0x1F;
      break;
    case Part::temperature:
      values.temperature = static_cast<std::int8_t>(reply.temperature);
      break;
    case Part::redundant_sequence:
      values.redundant = reply.redundant;
      [[fallthrough]];
    case Part::zero_sequence:
      values.ch2_sequence = channel.sequence;
      break;
    case Part::redundant_alone:
    case Part::redundant_calibration:
      values.redundant = reply.redundant;
      break;
    case Part::memory_address:
      values.memory_address = reply.memory_address;
      values.busy = reply.busy;
      break;
    case Part::value:
      values.value = reply.value;
      break;
  }
}

}  // namespace detail

/// Every field that a reply of this id carries.
[[nodiscard]] constexpr Values values_of(const Reply& reply) {
  Values values{.data_id = reply.id, .encoder_address = reply.encoder_address};
  for (const Part part : layout_of(reply.id).one()) detail::put_part(values, part, reply, true);
  for (const Part part : layout_of(reply.id).two()) detail::put_part(values, part, reply, false);
  return values;
}

namespace detail {

// Where a part that begins at this byte has a field; no place: it is not one of its own.
constexpr BitRanges place_in(const Profile& profile, Part part, std::size_t byte, bool first, const FieldInfo& field) {
  using author::bits_of;
  const auto is = [&field](const FieldInfo* one) { return one == &field; };
  // RS: its low bit stands beside or behind SC2, those above in a byte before.
  const auto redundant = [&](std::size_t low_bit) {
    BitRanges ranges = bits_of(byte + 1, low_bit, 1);
    ranges.push_back({8 * byte, 8});
    return ranges;
  };
  const bool low_at_7 = profile.rs1_sc2 == RedundantBit::b7;
  const bool as_document = profile.memory_address_order == FieldOrder::document;
  switch (part) {
    case Part::status: {
      if (!is(first ? fields.of<&Values::ch1_status>() : fields.of<&Values::ch2_status>())) return {};
      if (profile.status_order == FieldOrder::document) return bits_of(byte, 0, 8);
      BitRanges ranges = bits_of(byte, 6, 2);
      ranges.push_back({8 * byte + 4, 2});
      ranges.push_back({8 * byte, 4});
      return ranges;
    }
    case Part::alarms:
      return bits_of(byte, 0, is(first ? fields.of<&Values::ch1_alarms>() : fields.of<&Values::ch2_alarms>()) ? 8 : 0);
    case Part::singleturn:
      return bits_of(byte, 0, is(fields.of<&Values::singleturn>()) ? singleturn_bits : 0);
    case Part::multiturn:
      return bits_of(byte, 0, is(fields.of<&Values::multiturn>()) ? multiturn_bits : 0);
    case Part::sequence:
      return bits_of(byte, 0, is(fields.of<&Values::ch1_sequence>()) ? 8 : 0);
    case Part::encoder_id:
      if (is(fields.of<&Values::encoder_id>())) return bits_of(byte, 0, 8);
      if (is(fields.of<&Values::safety>())) return bits_of(byte, 7, 1);
      if (is(fields.of<&Values::multiturn_bytes>())) return bits_of(byte, 5, 2);
      return bits_of(byte, 0, is(fields.of<&Values::singleturn_bits>()) ? 5 : 0);
    case Part::temperature:
      return bits_of(byte, 0, is(fields.of<&Values::temperature>()) ? 8 : 0);
    case Part::redundant_sequence:
      if (is(fields.of<&Values::redundant>())) return redundant(low_at_7 ? 7 : 0);
      return bits_of(byte + 1, low_at_7 ? 0 : 1, is(fields.of<&Values::ch2_sequence>()) ? 7 : 0);
    case Part::zero_sequence:
      return bits_of(byte, low_at_7 ? 0 : 1, is(fields.of<&Values::ch2_sequence>()) ? 7 : 0);
    case Part::redundant_alone:
      return is(fields.of<&Values::redundant>()) ? redundant(profile.idc_rs1 == RedundantBit::b7 ? 7 : 0) : BitRanges{};
    case Part::redundant_calibration:
      if (!is(fields.of<&Values::redundant>())) return {};
      return profile.id6_rs == Id6Redundant::bits_16 ? author::big_endian_bits(byte, 2, 16) : redundant(0);
    case Part::memory_address:
      if (is(fields.of<&Values::busy>())) return bits_of(byte, as_document ? 0 : 7, 1);
      return bits_of(byte, as_document ? 1 : 0, is(fields.of<&Values::memory_address>()) ? 7 : 0);
    case Part::value:
      return bits_of(byte, 0, is(fields.of<&Values::value>()) ? 8 : 0);
  }
  return {};
}

}  // namespace detail

/// Where a good reply has a field that it carries.
[[nodiscard]] constexpr BitRanges place_of(const Profile& profile, Bytes reply, const FieldInfo& field) {
  if (&field == fields.of<&Values::encoder_address>()) return author::bits_of(0, 0, 3);
  if (&field == fields.of<&Values::data_id>()) return author::bits_of(0, 3, 4);
  const Layout& layout = layout_of(data_id(reply[0]).value_or(DataId::position));
  for (const bool first : {true, false}) {
    std::size_t byte = first ? 1 : layout.length_one + 1;
    for (const Part part : first ? layout.one() : layout.two()) {
      const BitRanges place = detail::place_in(profile, part, byte, first, field);
      if (!place.empty()) return place;
      byte += size_of(part);
    }
  }
  return {};
}

/// What was asked: the request, or without one what the reply's own control field says; the address of a memory access
/// is then taken as it comes.
constexpr Result<Request> asked_by(const Profile& profile, Bytes request, Bytes reply) {
  if (!request.empty()) return decode_request(profile, request);
  if (reply.empty()) return Error::wrong_length;
  const auto id = data_id(reply[0]);
  if (!id) return Error::unexpected_reply;
  Request asked{*id, address_of(reply[0])};
  if (is_memory_access(asked.id) && reply.size() == reply_length(asked.id)) {
    asked.memory_address = detail::address_from_wire(profile, reply[1]);
    asked.value = reply[2];
  }
  return asked;
}

}  // namespace absenc::esl
