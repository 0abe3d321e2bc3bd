// SPDX-License-Identifier: Apache-2.0
// Names, units and meanings of everything in an ESL frame, in words for the person in front of the machine.
#pragma once

#include <array>
#include <cstddef>

#include "absenc/protocol/esl/reply.hpp"
#include "absenc/protocol/field.hpp"

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

inline constexpr std::array<FlagInfo, 8> address_flags{{
    {"address_0", "", ""},
    {"address_1", "", ""},
    {"address_2", "", ""},
    {"address_3", "", ""},
    {"address_4", "", ""},
    {"address_5", "", ""},
    {"address_6", "", ""},
    {"address_7", "", ""},
}};

enum FieldIndex : std::size_t {
  field_data_id,
  field_control_field,
  field_encoder_address,
  field_ch1_status,
  field_ch1_alarms,
  field_singleturn,
  field_multiturn,
  field_ch1_sequence,
  field_encoder_id,
  field_safety,
  field_multiturn_bytes,
  field_singleturn_bits,
  field_temperature,
  field_ch2_status,
  field_ch2_alarms,
  field_redundant_singleturn,
  field_ch2_sequence,
  field_memory_address,
  field_busy,
  field_value,
  field_page,
  field_data,
  field_written,
  field_led_error,
  field_lissajous_error,
  field_safe_singleturn,
  field_answering,
  field_disturbed,
  field_clash,
  field_page_left,
};

inline constexpr std::array<FieldInfo, 30> fields{{
    {"data_id", FieldInfo::Kind::number, "", "which data was asked for (Table 3)"},
    {"control_field", FieldInfo::Kind::number, "", "CF: encoder address, data id, parity"},
    {"encoder_address", FieldInfo::Kind::number, "", "EAD: which encoder on the line"},
    {"ch1_status", FieldInfo::Kind::flags, "", "SF of channel 1", status_flags},
    {"ch1_alarms", FieldInfo::Kind::flags, "", "ALM of channel 1", alarm_flags},
    {"singleturn", FieldInfo::Kind::number, "counts", "ABS: position within the turn", {}, Shows::position},
    {"multiturn", FieldInfo::Kind::number, "revolutions", "ABM", {}, Shows::turns},
    {"ch1_sequence", FieldInfo::Kind::number, "", "SC1: counts the replies, 0 to 255"},
    {"encoder_id", FieldInfo::Kind::number, "", "ENID: D8 multi-turn, 98 single-turn"},
    {"safety", FieldInfo::Kind::number, "", "1: a safety encoder (ENID bit 7)"},
    {"multiturn_bytes", FieldInfo::Kind::number, "", "of turns (ENID bits 6 and 5)"},
    {"singleturn_bits", FieldInfo::Kind::number, "", "of the position within the turn (ENID bits 4 to 0)"},
    {"temperature_c", FieldInfo::Kind::number, "degC", "inside the encoder"},
    {"ch2_status", FieldInfo::Kind::flags, "", "SF of channel 2", status_flags},
    {"ch2_alarms", FieldInfo::Kind::flags, "", "ALM of channel 2", alarm_flags},
    {"redundant_singleturn",
     FieldInfo::Kind::number,
     "counts",
     "RS: the position of channel 2, 9 bits (ID 6: 16)",
     {},
     Shows::position},
    {"ch2_sequence", FieldInfo::Kind::number, "", "SC2: counts the replies, 0 to 127"},
    {"memory_address", FieldInfo::Kind::number, "", "ADF: 0 to 126; 127 selects the page"},
    {"busy", FieldInfo::Kind::number, "", "1 while the memory is read or written: the request was not executed"},
    {"value", FieldInfo::Kind::number, "", "EDF: the byte in memory"},
    {"page", FieldInfo::Kind::number, "", "memory page"},
    {"data", FieldInfo::Kind::bytes, "", "the bytes in memory from `memory_address` on"},
    {"written", FieldInfo::Kind::boolean, "", "false when the value was there already"},
    {"led_error", FieldInfo::Kind::boolean, "", "the LED current is out of its range"},
    {"lissajous_error", FieldInfo::Kind::boolean, "", "the signals of the disc are out of their range"},
    {"safe_singleturn", FieldInfo::Kind::number, "counts", "the position, every check of a safety reader passed"},
    {"answering", FieldInfo::Kind::flags, "", "addresses with an encoder that answers well", address_flags},
    {"disturbed", FieldInfo::Kind::flags, "",
     "addresses whose answer is damaged: check the line, and whether two encoders share the address", address_flags},
    {"clash", FieldInfo::Kind::boolean, "",
     "yes: its answer is damaged every time; two encoders share the address, or the line is bad"},
    {"page_left", FieldInfo::Kind::number, "",
     "memory page that is left selected, also for whoever reads next: which one was before is not known"},
}};

constexpr void put(FieldSink& sink, FieldIndex field, std::int64_t number) { sink.put({&fields[field], number}); }

/// Every field that the request carries.
constexpr void put_fields(FieldSink& sink, const Profile& profile, const Request& request) {
  put(sink, field_data_id, static_cast<std::int64_t>(request.id));
  put(sink, field_control_field, control_field(profile, request.encoder_address, request.id));
  put(sink, field_encoder_address, request.encoder_address);
  if (is_memory_access(request.id)) put(sink, field_memory_address, request.memory_address);
  if (request.id == DataId::write_memory) put(sink, field_value, request.value);
}

namespace detail {

constexpr void put_part(FieldSink& sink, Part part, const Reply& reply, const ChannelReply& channel, bool first) {
  switch (part) {
    case Part::status:
      return put(sink, first ? field_ch1_status : field_ch2_status, channel.status);
    case Part::alarms:
      return put(sink, first ? field_ch1_alarms : field_ch2_alarms, channel.alarms);
    case Part::singleturn:
      return put(sink, field_singleturn, reply.singleturn);
    case Part::multiturn:
      return put(sink, field_multiturn, reply.multiturn);
    case Part::sequence:
      return put(sink, field_ch1_sequence, channel.sequence);
    case Part::encoder_id:
      if (!first) return;  // the same as in channel 1
      put(sink, field_encoder_id, channel.encoder_id);
      put(sink, field_safety, channel.encoder_id >> 7);
      put(sink, field_multiturn_bytes, channel.encoder_id >> 5 & 3);
      return put(sink, field_singleturn_bits, channel.encoder_id & 0x1F);
    case Part::temperature:  // its sign is assumed
      return put(sink, field_temperature, static_cast<std::int8_t>(reply.temperature));
    case Part::redundant_sequence:
      put(sink, field_redundant_singleturn, reply.redundant);
      return put(sink, field_ch2_sequence, channel.sequence);
    case Part::zero_sequence:
      return put(sink, field_ch2_sequence, channel.sequence);
    case Part::redundant_alone:
    case Part::redundant_calibration:
      return put(sink, field_redundant_singleturn, reply.redundant);
    case Part::memory_address:
      put(sink, field_memory_address, reply.memory_address);
      return put(sink, field_busy, reply.busy ? 1 : 0);
    case Part::value:
      return put(sink, field_value, reply.value);
  }
}

}  // namespace detail

/// Every field that a reply of this id carries, in the order of the wire.
constexpr void put_fields(FieldSink& sink, const Reply& reply) {
  put(sink, field_data_id, static_cast<std::int64_t>(reply.id));
  put(sink, field_encoder_address, reply.encoder_address);
  for (const Part part : layout_of(reply.id).one()) detail::put_part(sink, part, reply, reply.one, true);
  for (const Part part : layout_of(reply.id).two()) detail::put_part(sink, part, reply, reply.two, false);
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

/// Decodes a reply to `request`, or `request` alone when there is no reply.
constexpr Error decode(const Profile& profile, Bytes request, Bytes reply, FieldSink& sink) {
  const Result<Request> asked = asked_by(profile, request, reply);
  if (!asked) return asked.error();
  if (reply.empty()) {
    put_fields(sink, profile, *asked);
    return Error::none;
  }
  const Result<Reply> result = decode_reply(profile, *asked, reply);
  if (!result) return result.error();
  put_fields(sink, *result);
  const Reading reading = to_reading(*result);
  if (reading.singleturn_bits != 0 || reading.multiturn_bits != 0) sink.put_reading(reading);
  return Error::none;
}

}  // namespace absenc::esl
