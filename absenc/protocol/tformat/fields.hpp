// SPDX-License-Identifier: Apache-2.0
// Names, units and meanings of everything in a T-format frame, in words for the person in front of the machine.
#pragma once

#include <array>
#include <cstddef>

#include "absenc/protocol/field.hpp"
#include "absenc/protocol/tformat/frame.hpp"

namespace absenc::tformat {

// 6.3.2
inline constexpr std::array<FlagInfo, 8> status_flags{{
    {"", "", ""},
    {"", "", ""},
    {"", "", ""},
    {"", "", ""},
    {"counting_error", "the position within the turn is wrong", "read the alarms (data ID 3)"},
    {"alarm", "over-heat, multi-turn error, battery error or battery alarm", "read the alarms (data ID 3)"},
    {"parity_error", "the encoder received the request with a parity error", "send the same request again"},
    {"delimiter_error", "the encoder received the request with a wrong stop bit", "send the same request again"},
}};

// 6.5
inline constexpr std::array<FlagInfo, 8> alarm_flags{{
    {"over_speed", "the shaft turned faster than the counter follows while the power was off: turns may be wrong",
     "return to the origin, then reset-multiturn or clear-alarms"},
    {"full_absolute_status", "switched on at 100 rpm or more: only the top 5 bits of the position hold",
     "slow down below 100 rpm and wait until it clears by itself"},
    {"counting_error", "the position within the turn was found wrong",
     "stop the servo system at once; then clear-alarms, or switch the encoder off and on"},
    {"counter_overflow", "the turn counter went past its end and goes on from the other one", "clear-alarms"},
    {"over_heat", "the encoder is or was hotter than its threshold", "let it cool, then clear-alarms"},
    {"multiturn_error", "a bit of the turn counter jumped: turns are wrong",
     "return to the origin, then reset-multiturn"},
    {"battery_error", "the battery was below 2.75 V while the power was off: turns are lost",
     "check or replace the battery, return to the origin, then reset-multiturn"},
    {"battery_alarm", "the battery is below 3.1 V", "replace the battery with the encoder switched on"},
}};

enum FieldIndex : std::size_t {
  field_data_id,
  field_control_field,
  field_status,
  field_singleturn,
  field_encoder_id,
  field_multiturn,
  field_alarms,
  field_page,
  field_address,
  field_busy,
  field_value,
  field_data,
  field_written,
  field_temperature,
  field_overheat_enabled,
  field_overheat_threshold,
  field_page_left,
};

inline constexpr std::array<FieldInfo, 17> fields{{
    {"data_id", FieldInfo::Kind::number, "", "which data was asked for (Table 1)"},
    {"control_field", FieldInfo::Kind::number, "", "first byte of the request: sync code, data id, parity"},
    {"status", FieldInfo::Kind::flags, "", "SF", status_flags},
    {"singleturn",
     FieldInfo::Kind::number,
     "counts",
     "ABS: position within the turn, rising counter-clockwise",
     {},
     Shows::position},
    {"encoder_id", FieldInfo::Kind::number, "", "ENID"},
    {"multiturn", FieldInfo::Kind::number, "revolutions", "ABM", {}, Shows::turns},
    {"alarms", FieldInfo::Kind::flags, "", "ALMC", alarm_flags},
    {"page", FieldInfo::Kind::number, "", "memory page"},
    {"address", FieldInfo::Kind::number, "", "ADF: memory address; 127 selects the page"},
    {"busy", FieldInfo::Kind::number, "", "1 while the encoder writes: the request was not executed"},
    {"value", FieldInfo::Kind::number, "", "EDF: the byte in memory"},
    {"data", FieldInfo::Kind::bytes, "", "the bytes in memory from `address` on"},
    {"written", FieldInfo::Kind::boolean, "", "false when the value was there already"},
    {"temperature_c", FieldInfo::Kind::number, "degC", "of the encoder's board, within 3 degC"},
    {"overheat_enabled", FieldInfo::Kind::boolean, "", "whether over_heat is watched"},
    {"overheat_threshold_c", FieldInfo::Kind::number, "degC", "over_heat above this"},
    {"page_left", FieldInfo::Kind::number, "",
     "memory page that is left selected, also for whoever reads next: which one was before is not known"},
}};

constexpr void put(FieldSink& sink, FieldIndex field, std::int64_t number) { sink.put({&fields[field], number}); }

/// Every field that the request carries.
constexpr void put_fields(FieldSink& sink, const Request& request) {
  put(sink, field_data_id, static_cast<std::int64_t>(request.id));
  put(sink, field_control_field, control_field(request.id));
  if (is_memory_access(request.id)) put(sink, field_address, request.address);
  if (request.id == DataId::write_memory) put(sink, field_value, request.value);
}

/// Every field that a reply of this id carries, in the order of the wire.
constexpr void put_fields(FieldSink& sink, const Reply& reply) {
  put(sink, field_data_id, static_cast<std::int64_t>(reply.id));
  if (is_memory_access(reply.id)) {
    put(sink, field_address, reply.address);
    put(sink, field_busy, reply.busy ? 1 : 0);
    put(sink, field_value, reply.value);
    return;
  }
  put(sink, field_status, reply.status);
  if (reply.id == DataId::multiturn) {
    put(sink, field_multiturn, reply.multiturn);
  } else if (reply.id == DataId::encoder_id) {
    put(sink, field_encoder_id, reply.encoder_id);
  } else {
    put(sink, field_singleturn, reply.singleturn);
  }
  if (reply.id == DataId::everything) {
    put(sink, field_encoder_id, reply.encoder_id);
    put(sink, field_multiturn, reply.multiturn);
    put(sink, field_alarms, reply.alarms);
  }
}

/// Decodes a reply to `request`, or `request` alone when there is no reply. Without a request, the reply's own control
/// field says what was asked, and the address of a memory access is taken as it comes.
constexpr Error decode(const Format& format, Bytes request, Bytes reply, FieldSink& sink) {
  Request asked;
  if (!request.empty()) {
    const Result<Request> result = decode_request(request);
    if (!result) {
      // What the encoder cannot accept is answered like ID 3 (8.4, 9.4).
      const bool refused = reply.size() == reply_length(DataId::everything) && checksum(reply) == 0 &&
                           reply[0] == control_field(DataId::everything);
      return refused ? Error::request_rejected : result.error();
    }
    asked = *result;
  } else {
    if (reply.empty()) return Error::wrong_length;
    const auto id = data_id(reply[0]);
    if (!id) return Error::unexpected_reply;
    asked.id = *id;
    if (is_memory_access(asked.id) && reply.size() == reply_length(asked.id)) {
      asked.address = reply[1] & 0x7F;
      asked.value = reply[2];
    }
  }
  if (reply.empty()) {
    put_fields(sink, asked);
    return Error::none;
  }
  const Result<Reply> result = decode_reply(format, asked, reply);
  if (!result) return result.error();
  put_fields(sink, *result);
  const Reading reading = to_reading(format, *result);
  if (reading.singleturn_bits != 0 || reading.multiturn_bits != 0) sink.put_reading(reading);
  return Error::none;
}

}  // namespace absenc::tformat
