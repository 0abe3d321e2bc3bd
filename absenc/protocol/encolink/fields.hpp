// SPDX-License-Identifier: Apache-2.0
// Names, units and meanings of everything in EncoLink frames and registers, in words for the person at the machine.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absenc/protocol/encolink/frame.hpp"
#include "absenc/protocol/encolink/registers.hpp"
#include "absenc/protocol/field.hpp"

namespace absenc::encolink {

inline constexpr std::array<FlagInfo, 2> general_flags{{
    {"error", "the position is not valid", "read the alarms"},
    {"warning", "the position is valid, but something is near its limit", "read the alarms"},
}};

/// What out_of_range means in a position.
inline constexpr std::string_view wrong_resolution =
    "padding bits are set: the encoder has more bits than the options resolution and multiturn_bits say; `info` asks "
    "it";

/// Why the registers of an AksIM-4 are refused.
inline constexpr std::string_view not_described =
    "protocol version 4 (AksIM-4) has its registers at other addresses, which are not described here: its positions "
    "may "
    "be read";

// What to do is ours: the vendor only names the bits.
inline constexpr std::array<FlagInfo, 16> alarm_flags{{
    {"acceleration_error", "the position changed faster than a shaft can", "check the fixing of ring and readhead"},
    {"magnetic_pattern_error", "the magnetic pattern of the ring is not what it should be",
     "check that ring and readhead belong together; look for damage and magnetic dirt"},
    {"system_error", "the encoder found a fault in itself", "switch it off and on; if it comes back, replace it"},
    {"supply_error", "the supply voltage is outside its range", "measure the supply at the encoder's connector"},
    {"temperature_warning", "the readhead is hotter or colder than it may be", "cool or warm it"},
    {"signal_lost", "the readhead does not see the ring", "check the gap between ring and readhead"},
    {"amplitude_low", "the signal is weak: the readhead is too far from the ring", "make the gap smaller"},
    {"amplitude_high", "the signal is strong: the readhead is too near to the ring", "make the gap wider"},
    {"near_limits", "the encoder works near the limits of its range", "check gap and alignment of the readhead"},
    {"position_invalid", "the position is not valid", "do not use it; look at the other alarms"},
    {"configuration_error", "the stored configuration is damaged", "reset, set it up again and save"},
    {"reading_error", "the sensor could not be read", "switch it off and on; if it comes back, replace it"},
    {"sensor_error", "the magnetic sensor is faulty", "check for magnetic fields from outside, then replace it"},
    {"amplitude_too_high_warning", "the signal is nearly too strong", "make the gap wider"},
    {"amplitude_too_high", "the signal is too strong to be read", "make the gap wider"},
    {"multiturn_mismatch", "the turn counter does not fit the position: turns are wrong",
     "go to the origin, then reset-multiturn"},
}};

inline constexpr std::array<FlagInfo, 4> calibration_flags{{
    {"", "", ""},
    {"", "", ""},
    {"timed_out", "the shaft did not turn far enough in time", "turn it evenly and calibrate again"},
    {"out_of_range", "the ring is too eccentric to be calibrated", "mount the ring again, then calibrate again"},
}};

enum FieldIndex : std::size_t {
  field_general_status,
  field_alarms,
  field_singleturn,
  field_multiturn,
  field_error,
  field_warning,
  field_channel2,
  field_status,
  field_channel3,
  field_protocol_version,
  field_frame_bytes,
  field_resolution,
  field_part_number,
  field_config,
  field_ra,
  field_op,
  field_register,
  field_address,
  field_length,
  field_data,
  field_value,
  field_registers,  // one for each of the table, in its order
  field_calibrations = field_registers + registers.size(),
  field_running,
  field_not_described,
  field_count,
};

namespace detail {

constexpr FieldInfo register_field(const Register& one) {
  switch (one.content) {
    case Content::tenths:
      return {one.name, FieldInfo::Kind::real, one.name == "speed_rpm" ? "rpm" : "degC", "register, in tenths"};
    case Content::flags:
      return {one.name, FieldInfo::Kind::flags, "", "how the last self-calibration ended", calibration_flags};
    case Content::text:
      return {one.name, FieldInfo::Kind::text, "", "register"};
    case Content::number:
      break;
  }
  return {one.name, FieldInfo::Kind::number, "", "register"};
}

constexpr std::array<FieldInfo, field_count> make_fields() {
  using Kind = FieldInfo::Kind;
  std::array<FieldInfo, field_count> fields{{
      {"general_status", Kind::flags, "", "the two low bits of a position frame, active low", general_flags},
      {"alarms", Kind::flags, "", "detailed status", alarm_flags},
      {"singleturn", Kind::number, "counts", "position within the turn", {}, Shows::position},
      {"multiturn", Kind::number, "revolutions", "turn counter", {}, Shows::turns},
      {"error", Kind::boolean, "", "the position is not valid"},
      {"warning", Kind::boolean, "", "the position is valid, but something is near its limit"},
      {"channel2", Kind::number, "", "one byte of channel 2; the checksum does not cover it"},
      {"status", Kind::number, "", "detailed status of a channel 2 cycle"},
      {"channel3", Kind::number, "", "one byte of channel 3: 33 idle, 66 busy, 88 and 99 ready, or data"},
      {"protocol_version", Kind::number, "", "of EncoLink: 2 or 4"},
      {"frame_bytes", Kind::number, "", "5 without turns, 7 with"},
      {"resolution", Kind::number, "bits", "of a turn"},
      {"part_number", Kind::text, "", "from the identity"},
      {"config", Kind::number, "", "first byte of a request: 00 position, AA reset of the channels, BB identify"},
      {"ra", Kind::number, "", "second byte of a request: one byte of a register access"},
      {"op", Kind::text, "", "read or write"},
      {"register", Kind::text, "", "its name in the table of registers"},
      {"address", Kind::number, "", "of the register"},
      {"length", Kind::number, "bytes", "of the register"},
      {"data", Kind::bytes, "", "the register's bytes, most significant first"},
      {"value", Kind::number, "", "the same as a number"},
  }};
  for (std::size_t i = 0; i < registers.size(); ++i) fields[field_registers + i] = register_field(registers[i]);
  fields[field_calibrations] = {"calibrations", Kind::number, "", "self-calibrations that ended, modulo 4"};
  fields[field_not_described] = {"registers", Kind::text, "", "why none of them is shown"};
  fields[field_running] = {"running", Kind::boolean, "", "whether the self-calibration still goes on"};
  return fields;
}

}  // namespace detail

inline constexpr std::array<FieldInfo, field_count> fields = detail::make_fields();

constexpr void put(FieldSink& sink, std::size_t field, std::int64_t number) { sink.put({&fields[field], number}); }
constexpr void put(FieldSink& sink, std::size_t field, Bytes bytes) {
  sink.put({.info = &fields[field], .bytes = bytes});
}

constexpr void put_fields(FieldSink& sink, const Format& format, const Position& position) {
  put(sink, field_singleturn, position.singleturn);
  if (format.multiturn_bits > 0) put(sink, field_multiturn, position.multiturn);
  put(sink, field_error, position.error ? 1 : 0);
  put(sink, field_warning, position.warning ? 1 : 0);
  if (format.has_ch2) put(sink, field_channel2, position.channel2);
  sink.put_reading(to_reading(format, position));
}

constexpr void put_fields(FieldSink& sink, const Format& format, const Cycle& cycle) {
  put(sink, field_singleturn, cycle.position.singleturn);
  if (format.multiturn_bits > 0) put(sink, field_multiturn, cycle.position.multiturn);
  put(sink, field_error, cycle.position.error ? 1 : 0);
  put(sink, field_warning, cycle.position.warning ? 1 : 0);
  put(sink, field_status, cycle.status);
  put(sink, field_alarms, cycle.status);
  put(sink, field_channel3, cycle.channel3);
  Reading reading = to_reading(format, cycle.position);
  add_status(reading, cycle.status);
  sink.put_reading(reading);
}

constexpr void put_fields(FieldSink& sink, const Identity& identity) {
  put(sink, field_protocol_version, identity.protocol_version);
  put(sink, field_frame_bytes, identity.frame_bytes);
  put(sink, field_resolution, identity.resolution);
  put(sink, field_part_number, identity.part_number());
}

constexpr void put_fields(FieldSink& sink, const RegisterRequest& request) {
  constexpr std::array<std::uint8_t, 4> read{'r', 'e', 'a', 'd'};
  constexpr std::array<std::uint8_t, 5> write{'w', 'r', 'i', 't', 'e'};
  const bool reads = request.operation == RegisterRequest::Operation::read;
  put(sink, field_op, reads ? Bytes(read) : Bytes(write));
  put(sink, field_address, request.address);
  put(sink, field_length, request.length);
  if (!reads) put(sink, field_data, request.data);
}

/// Two's complement of 1 to 8 bytes.
[[nodiscard]] constexpr std::int64_t signed_value(Bytes bytes) {
  const auto bits = static_cast<unsigned>(8 * bytes.size());
  return bits >= 64 ? static_cast<std::int64_t>(load_big_endian(bytes))
                    : wrapped_difference(load_big_endian(bytes), 0, bits);
}

/// What the bytes of a register of the table mean.
constexpr void put_value(FieldSink& sink, std::size_t index, Bytes bytes) {
  const FieldInfo* info = &fields[field_registers + index];
  switch (registers[index].content) {
    case Content::number:
      sink.put({info, static_cast<std::int64_t>(load_big_endian(bytes))});
      break;
    case Content::flags:
      sink.put({info, bytes[0]});
      put(sink, field_calibrations, bytes[0] & calibration::count);
      break;
    case Content::tenths:
      sink.put({.info = info, .real = static_cast<double>(signed_value(bytes)) / 10});
      break;
    case Content::text:
      sink.put({.info = info, .bytes = bytes});
      break;
  }
}

/// What a frame is decoded with where the encoder cannot be asked: all 22 bits, turns as the length tells.
[[nodiscard]] constexpr Format assumed(const Format& format, Bytes reply) {
  Format known = format;
  if (known.resolution == 0) known.resolution = maximum_resolution;
  if (known.multiturn_bits >= 0) return known;
  known.multiturn_bits = 16;
  const bool turns = reply.size() == known.cycle_bytes() ||
                     (reply.size() == known.frame_bytes() && is_sealed(reply.first(known.position_bytes() + 1)));
  if (!turns) known.multiturn_bits = 0;
  return known;
}

/// The request alone: two bytes, or all the `ra` bytes of a register access.
constexpr Error decode_request(Bytes request, FieldSink& sink) {
  if (request.size() != request_bytes) {
    const Result<RegisterRequest> access = decode_access(request);
    if (access) put_fields(sink, *access);
    return access.error();
  }
  const auto config = static_cast<Config>(request[0]);
  if (config != Config::position && config != Config::reset_channels && config != Config::identify) {
    return Error::unsupported;
  }
  put(sink, field_config, request[0]);
  put(sink, field_ra, request[1]);
  return Error::none;
}

/// The length of a reply says what it is: a position frame, a channel 2 cycle or the identity.
constexpr Error decode(const Format& format, Bytes request, Bytes reply, FieldSink& sink) {
  if (reply.empty()) return decode_request(request, sink);
  if (reply.size() == identity_bytes || reply.size() == padded_identity_bytes) {
    const Result<Identity> identity = decode_identity(reply);
    if (identity) put_fields(sink, *identity);
    return identity.error();
  }
  const Format known = assumed(format, reply);
  if (known.has_ch2 && reply.size() == known.cycle_bytes()) {
    const Result<Cycle> cycle = decode_cycle(known, reply);
    if (cycle) put_fields(sink, known, *cycle);
    return cycle.error();
  }
  const Result<Position> position = decode_position(known, reply);
  if (position) put_fields(sink, known, *position);
  return position.error();
}

}  // namespace absenc::encolink
