// SPDX-License-Identifier: Apache-2.0
// Names and meanings of what the RAA38S6 says on asynchronous lines, and what decoding puts.
#pragma once

#include <array>

#include "absenc/protocol/field.hpp"
#include "absenc/protocol/raa38/serial/frame.hpp"

namespace absenc::raa38::serial {

enum FieldIndex : std::size_t {
  field_singleturn,
  field_second_byte,
  field_angle_deg,
  field_command,
  field_unit,
  field_encoder_address,
  field_clash,
  field_before,
  field_skipped,
};

inline constexpr std::array<FieldInfo, 9> fields{{
    {"singleturn", FieldInfo::Kind::number, "counts", "position within the turn", {}, Shows::position},
    {"second_byte", FieldInfo::Kind::number, "", "81, or on a bus Bx: the encoder's number"},
    {"angle_deg", FieldInfo::Kind::real, "deg", "the same as an angle", {}, Shows::position},
    {"command", FieldInfo::Kind::text, "", "read or zero_clear"},
    {"unit", FieldInfo::Kind::number, "", "the number behind B or C"},
    {"encoder_address", FieldInfo::Kind::number, "", "the number behind B"},
    {"clash", FieldInfo::Kind::boolean, "", "every answer is damaged: two encoders, or a bad line"},
    {"before", FieldInfo::Kind::number, "counts", "position before the zero was set"},
    {"skipped", FieldInfo::Kind::number, "bytes", "so far, that belonged to no good frame"},
}};

constexpr void put(FieldSink& sink, FieldIndex field, std::int64_t number) {
  sink.put({.info = &fields[field], .number = number});
}

constexpr void put_position(FieldSink& sink, const Format& format, const Position& position) {
  put(sink, field_singleturn, position.singleturn);
  put(sink, field_second_byte, position.second_byte);
  sink.put({.info = &fields[field_angle_deg], .real = degrees(position.singleturn, format.bits)});
  sink.put_reading(to_reading(format, position, {}, {}));
}

namespace detail {
inline constexpr std::array<std::uint8_t, 4> read_text{'r', 'e', 'a', 'd'};
inline constexpr std::array<std::uint8_t, 10> zero_text{'z', 'e', 'r', 'o', '_', 'c', 'l', 'e', 'a', 'r'};
}  // namespace detail

/// A reply with its request, if there was one; without a reply the request itself.
[[nodiscard]] constexpr Error decode(const Format& format, Bytes request, Bytes reply, FieldSink& sink) {
  int unit = anybody;
  if (!request.empty()) {
    const Result<Request> asked = decode_request(request);
    if (!asked) return asked.error();
    if (reply.empty()) {
      const bool reads = asked->kind == Request::Kind::read;
      sink.put({.info = &fields[field_command], .bytes = reads ? Bytes(detail::read_text) : Bytes(detail::zero_text)});
      put(sink, field_unit, asked->unit);
      return Error::none;
    }
    if (asked->kind == Request::Kind::zero_clear) return Error::unexpected_reply;  // nothing answers it
    unit = asked->unit;
  }
  const Result<Position> position = decode_position(format, reply, unit);
  if (!position) return position.error();
  put_position(sink, format, *position);
  return Error::none;
}

}  // namespace absenc::raa38::serial
