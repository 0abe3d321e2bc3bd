// SPDX-License-Identifier: Apache-2.0
// Names and meanings of everything that an E201-9S says.
#pragma once

#include <array>

#include "absenc/protocol/biss/fields.hpp"
#include "absenc/protocol/e201/frame.hpp"
#include "absenc/protocol/word.hpp"

namespace absenc::e201 {

enum FieldIndex : std::size_t {
  field_command,
  field_version,
  field_serial,
  field_supply,
  field_supply_mv,
  field_supply_ma,
  field_clock,
  field_clock_khz,
  field_width,
  field_number,
  field_frames,
  field_valid,  // one for each clock
  field_recommended = field_valid + 8,
  field_recommended_khz,
  field_restored,
  field_aborted,
  field_left,
  field_left_khz,
  field_previous,
};

inline constexpr std::array<FieldInfo, 26> own_fields{{
    {"command", FieldInfo::Kind::text, "", "the request"},
    {"version", FieldInfo::Kind::text, "", "firmware of the interface"},
    {"serial", FieldInfo::Kind::text, "", "serial number of the interface"},
    {"supply", FieldInfo::Kind::text, "", "supply of the encoder, as the interface says it"},
    {"supply_mv", FieldInfo::Kind::number, "mV", "voltage in that text"},
    {"supply_ma", FieldInfo::Kind::number, "mA", "current in that text"},
    {"clock", FieldInfo::Kind::number, "", "setting of the MA clock, 1 to 8"},
    {"clock_khz", FieldInfo::Kind::number, "kHz", "MA clock"},
    {"width", FieldInfo::Kind::number, "bits", "width of the position that ? and > give"},
    {"counts", FieldInfo::Kind::number, "counts", "position, the interface's zero taken off"},
    {"frames", FieldInfo::Kind::number, "", "frames read at each clock"},
    {"valid_35_khz", FieldInfo::Kind::number, "", "good frames at 35 kHz"},
    {"valid_70_khz", FieldInfo::Kind::number, "", "good frames at 70 kHz"},
    {"valid_140_khz", FieldInfo::Kind::number, "", "good frames at 140 kHz"},
    {"valid_280_khz", FieldInfo::Kind::number, "", "good frames at 280 kHz"},
    {"valid_560_khz", FieldInfo::Kind::number, "", "good frames at 560 kHz"},
    {"valid_1100_khz", FieldInfo::Kind::number, "", "good frames at 1100 kHz"},
    {"valid_2200_khz", FieldInfo::Kind::number, "", "good frames at 2200 kHz"},
    {"valid_4400_khz", FieldInfo::Kind::number, "", "good frames at 4400 kHz"},
    {"recommended_clock", FieldInfo::Kind::number, "", "to be set with set-clock"},
    {"recommended_khz", FieldInfo::Kind::number, "kHz", "that clock"},
    {"restored_clock", FieldInfo::Kind::number, "", "what it was before and is again"},
    {"aborted", FieldInfo::Kind::boolean, "", "the sweep was ended early: not all clocks were tried"},
    {"left_clock", FieldInfo::Kind::number, "", "the clock that the sweep set last"},
    {"left_khz", FieldInfo::Kind::number, "kHz", "that clock"},
    {"previous_clock", FieldInfo::Kind::number, "", "what it was before: give it back with set-clock"},
}};

constexpr void put(FieldSink& sink, FieldIndex field, std::int64_t number) { sink.put({&own_fields[field], number}); }
constexpr void put_text(FieldSink& sink, FieldIndex field, Bytes text) {
  sink.put({&own_fields[field], 0, 0, trimmed(text)});
}

constexpr void put_position(FieldSink& sink, const Format& format, const Position& position) {
  if (format.carries == Carries::biss) {
    biss::put_fields(sink, format.biss, {position.ack_bits, position.word, position.life_counter, position.crc});
  } else {
    put_position(sink, format.word(), position.word, format.scale());
  }
}

/// Text first, numbers as far as they are found in it.
constexpr void put_supply(FieldSink& sink, Bytes text) {
  put_text(sink, field_supply, text);
  if (const auto voltage = find_milli(text, 'V')) put(sink, field_supply_mv, *voltage);
  if (const auto current = find_milli(text, 'A')) put(sink, field_supply_ma, *current);
}

constexpr void put_clock(FieldSink& sink, unsigned clock) {
  put(sink, field_clock, clock);
  put(sink, field_clock_khz, clocks_khz[clock - 1]);
}

namespace detail {

// A reply of one line to another request than `4`.
constexpr Error decode_line(std::uint8_t letter, Bytes reply, FieldSink& sink) {
  if (reply.empty() || reply.back() != end_of_line || trimmed(reply).empty()) return Error::wrong_length;
  for (const std::uint8_t c : trimmed(reply)) {
    if (c < 0x20 || c > 0x7E) return Error::bad_framing;
  }
  switch (letter) {
    case command::version:
      put_text(sink, field_version, reply);
      return Error::none;
    case command::serial:
      put_text(sink, field_serial, reply);
      return Error::none;
    case command::supply:
      put_supply(sink, reply);
      return Error::none;
    case command::clock: {
      const std::optional<unsigned> clock = find_clock(reply);
      if (!clock) return Error::bad_framing;
      put_clock(sink, *clock);
      return Error::none;
    }
    case command::width: {
      const std::optional<unsigned> width = find_number(reply);
      if (!width) return Error::bad_framing;
      put(sink, field_width, *width);
      return Error::none;
    }
    case command::decimal:
    case command::hexadecimal: {
      const Result<std::int64_t> number = decode_number(reply, letter == command::decimal ? 10 : 16);
      if (number) put(sink, field_number, *number);
      return number.error();
    }
    default:
      return Error::unsupported;  // no document says what these answer
  }
}

}  // namespace detail

/// Decodes a reply to `request`, or `request` alone when there is no reply. Without a request, `4` was asked.
constexpr Error decode(const Format& format, Bytes request, Bytes reply, FieldSink& sink) {
  const std::uint8_t letter = request.empty() ? command::samples : request[0];
  if (!command::is_known(letter)) return Error::unsupported;
  if (reply.empty()) {
    if (request.empty()) return Error::wrong_length;
    put_text(sink, field_command, request);
    return Error::none;
  }
  if (letter != command::samples) return detail::decode_line(letter, reply, sink);
  const Result<Position> position = decode_position(format, reply);
  if (position) put_position(sink, format, *position);
  return position.error();
}

}  // namespace absenc::e201
