// SPDX-License-Identifier: Apache-2.0
// Names and meanings of everything that an RAA38S6 says over Modbus RTU.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "absenc/protocol/field.hpp"
#include "absenc/protocol/raa38/modbus/frame.hpp"

namespace absenc::raa38::rtu {

enum FieldIndex : std::size_t {
  field_address,
  field_function,
  field_first_register,
  field_registers,
  field_singleturn,
  field_angle,
  field_new_address,
  field_parameter,
  field_setting,
  field_crc_order,
  field_baud,
  field_direction,
  field_effect,
  field_written,
  field_encoder_address,
  field_clash,
  field_refuses,
};

inline constexpr std::array<FieldInfo, 17> fields{{
    {"address", FieldInfo::Kind::number, "", "address of the encoder"},
    {"function", FieldInfo::Kind::number, "", "function code"},
    {"first_register", FieldInfo::Kind::number, "", "where reading begins"},
    {"registers", FieldInfo::Kind::number, "", "how many are asked for"},
    {"singleturn", FieldInfo::Kind::number, "counts", "position within the turn", {}, Shows::position},
    {"angle_deg", FieldInfo::Kind::real, "deg", "the same as an angle", {}, Shows::position},
    {"new_address", FieldInfo::Kind::number, "", "address from now on"},
    {"parameter", FieldInfo::Kind::number, "", "what function CC sets"},
    {"setting", FieldInfo::Kind::text, "", "the same in words"},
    {"crc_order", FieldInfo::Kind::text, "", "which byte of the CRC comes first"},
    {"baud", FieldInfo::Kind::number, "bit/s", "the baud rate at which it answers"},
    {"direction", FieldInfo::Kind::text, "", "in which direction it counts"},
    {"effect", FieldInfo::Kind::text, "", "what became of the position"},
    {"written", FieldInfo::Kind::boolean, "", "whether the setting was sent; it is not where it is so already"},
    {"encoder_address", FieldInfo::Kind::number, "", "address that answers"},
    {"clash", FieldInfo::Kind::boolean, "", "the answer is damaged every time"},
    {"refuses", FieldInfo::Kind::boolean, "", "it answers with an exception: another kind of Modbus slave?"},
}};

constexpr void put(FieldSink& sink, FieldIndex field, std::int64_t number) { sink.put({&fields[field], number}); }

/// A text of the program.
template <std::size_t Size>
constexpr void put_text(FieldSink& sink, FieldIndex field, const char (&text)[Size]) {
  std::array<std::uint8_t, Size - 1> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(text[i]);
  sink.put({&fields[field], 0, 0, bytes});
}

constexpr void put_order(FieldSink& sink, CrcOrder order) {
  if (order == CrcOrder::high_first) return put_text(sink, field_crc_order, "high_first");
  put_text(sink, field_crc_order, "low_first");
}

constexpr void put_setting(FieldSink& sink, std::uint8_t value) {
  put(sink, field_parameter, value);
  switch (value) {
    case parameter::zero:
      return put_text(sink, field_setting, "zero here");
    case parameter::positive:
      return put_text(sink, field_setting, "positive direction");
    case parameter::negative:
      return put_text(sink, field_setting, "negative direction");
    case 0x24:
      return put_text(sink, field_setting, "2400 baud");
    case 0x48:
      return put_text(sink, field_setting, "4800 baud");
    case 0x96:
      return put_text(sink, field_setting, "9600 baud");
    case 0x19:
      return put_text(sink, field_setting, "19200 baud");
    case 0x57:
      return put_text(sink, field_setting, "57600 baud");
    default:
      return put_text(sink, field_setting, "unknown");
  }
}

constexpr void put_position(FieldSink& sink, const Format& format, std::uint32_t singleturn) {
  put(sink, field_singleturn, singleturn);
  sink.put({&fields[field_angle], 0, degrees(singleturn, format.bits)});
  sink.put_reading({.singleturn = singleturn, .singleturn_bits = format.bits, .singleturn_valid_bits = format.bits});
}

constexpr void put_fields(FieldSink& sink, const Request& request) {
  if (request.function != function::ask_address) put(sink, field_address, request.address);
  put(sink, field_function, request.function);
  if (request.function == function::read) {
    put(sink, field_first_register, request.first_register);
    put(sink, field_registers, request.registers);
  }
  if (request.function == function::set_address) put(sink, field_new_address, request.value);
  if (request.function == function::set_parameter) put_setting(sink, request.value);
  put_order(sink, CrcOrder::low_first);
}

constexpr void put_fields(FieldSink& sink, const Format& format, const Reply& reply) {
  if (reply.function == function::set_address) {
    put(sink, field_new_address, reply.address);
  } else {
    put(sink, field_address, reply.address);
  }
  put(sink, field_function, reply.function);
  if (reply.function == function::read) put_position(sink, format, reply.singleturn);
  if (reply.function == function::set_parameter) put_setting(sink, reply.value);
  put_order(sink, reply.order);
}

/// Decodes a reply to `request`, or `request` alone when there is no reply. Without a request the reply must tell.
constexpr Error decode(const Format& format, Bytes request, Bytes reply, FieldSink& sink) {
  if (request.empty() && reply.empty()) return Error::wrong_length;
  const Result<Request> asked = request.empty() ? assumed_request(format, reply) : decode_request(request);
  if (!asked) return asked.error();
  if (reply.empty()) {
    put_fields(sink, *asked);
    return Error::none;
  }
  const Result<Reply> decoded = decode_reply(format, *asked, reply);
  if (decoded) put_fields(sink, format, *decoded);
  return decoded.error();
}

}  // namespace absenc::raa38::rtu
