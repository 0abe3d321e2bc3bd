// SPDX-License-Identifier: Apache-2.0
// Names and meanings of everything in the CAN frames of the RAA38S6, and their decoder.
#pragma once

#include <array>
#include <cstddef>

#include "absenc/core/angle.hpp"
#include "absenc/core/hex.hpp"
#include "absenc/protocol/field.hpp"
#include "absenc/protocol/raa38/can/frame.hpp"

namespace absenc::raa38::can {

enum FieldIndex : std::size_t {
  field_node,
  field_singleturn,
  field_angle_deg,
  field_function,
  field_data,
  field_command,
  field_value,
  field_readings_per_s,
  field_new_node,
  field_bit_rate,
  field_written,
  field_answered,
  field_before,
  field_after,
  field_mirrored,
  field_clash,
};

inline constexpr std::array<FieldInfo, 16> fields{{
    {"node", FieldInfo::Kind::number, "", "number of the node", {}, Role::encoder},
    {"singleturn", FieldInfo::Kind::counts, "counts", "position within one revolution", {}, Role::position},
    {"angle_deg", FieldInfo::Kind::real, "deg", "the same as an angle", {}, Role::of_position},
    {"function", FieldInfo::Kind::text, "", "what the identifier stands for in CANopen; this encoder does not use it"},
    {"data", FieldInfo::Kind::bytes, "", "its data"},
    {"command", FieldInfo::Kind::text, "", "what is asked, or answered"},
    {"value", FieldInfo::Kind::number, "", "counting direction as command 22 carries it"},
    {"readings_per_s", FieldInfo::Kind::number, "1/s", "positions that the node sends by itself"},
    {"new_node", FieldInfo::Kind::number, "", "number that the node is given"},
    {"bit_rate", FieldInfo::Kind::number, "bit/s", "bit rate that the node is given"},
    {"written", FieldInfo::Kind::boolean, "", "whether anything was written: not what is set already"},
    {"answered", FieldInfo::Kind::boolean, "", "whether the command was answered"},
    {"before", FieldInfo::Kind::counts, "counts", "position before the command"},
    {"after", FieldInfo::Kind::counts, "counts", "position after it"},
    {"mirrored", FieldInfo::Kind::boolean, "", "whether the position is counted the other way since"},
    {"clash", FieldInfo::Kind::boolean, "", "two nodes share this number, or the line is bad", {}, Role::clash},
}};

constexpr void put(FieldSink& sink, FieldIndex field, std::int64_t number) { sink.put({&fields[field], number}); }
constexpr void put_text(FieldSink& sink, FieldIndex field, Bytes text) { sink.put({&fields[field], 0, 0, text}); }

constexpr void put_position(FieldSink& sink, const Format& format, std::uint32_t counts) {
  put(sink, field_singleturn, counts);
  sink.put({&fields[field_angle_deg], 0, degrees(counts, format.bits)});
  sink.put_reading({.singleturn = counts, .singleturn_bits = format.bits, .singleturn_valid_bits = format.bits});
}

/// The name of a command; empty for none.
[[nodiscard]] constexpr Bytes name_of_command(std::uint8_t code) {
  switch (code) {
    case command::start:
      return ascii<"start">;
    case command::zero:
      return ascii<"zero">;
    case command::direction:
      return ascii<"direction">;
    case command::cyclic:
      return ascii<"cyclic">;
    case command::read:
      return ascii<"read">;
    default:
      return {};
  }
}

[[nodiscard]] constexpr Bytes name_of_configuration(std::uint8_t code) {
  switch (code) {
    case configuration::enter:
      return ascii<"enter-configuration">;
    case configuration::node:
      return ascii<"set-node">;
    case configuration::rate:
      return ascii<"bitrate">;
    default:
      return {};
  }
}

namespace detail {

constexpr void put_named(FieldSink& sink, const CanFrame& frame) {
  switch (function_of(frame)) {
    case Function::nmt:
      put_text(sink, field_function, ascii<"NMT">);
      break;
    case Function::sync:
      put_text(sink, field_function, ascii<"SYNC">);
      break;
    case Function::emergency:
      put(sink, field_node, node_of(frame));
      put_text(sink, field_function, ascii<"EMCY">);
      break;
    case Function::sdo_reply:
      put(sink, field_node, node_of(frame));
      put_text(sink, field_function, ascii<"SDO RX">);
      break;
    default:
      put(sink, field_node, node_of(frame));
      put_text(sink, field_function, ascii<"SDO TX">);
  }
  put_text(sink, field_data, frame.bytes());
}

// Bytes from `first` on are 0.
constexpr bool is_zero_from(const CanFrame& frame, std::size_t first) {
  for (std::size_t i = first; i < frame_size; ++i) {
    if (frame.data[i] != 0) return false;
  }
  return true;
}

constexpr Error decode_command(const CanFrame& frame, FieldSink* sink) {
  const std::uint8_t code = frame.data[0];
  const bool has_value = code == command::direction || code == command::cyclic;
  if (name_of_command(code).empty()) return Error::unsupported;
  if (!is_zero_from(frame, has_value ? 3 : 2)) return Error::out_of_range;
  if (frame.data[1] != node_of(frame)) return Error::cross_check_failed;
  if (sink == nullptr) return Error::none;
  put(*sink, field_node, node_of(frame));
  put_text(*sink, field_command, name_of_command(code));
  if (code == command::direction) put(*sink, field_value, frame.data[2]);
  if (code == command::cyclic) put(*sink, field_readings_per_s, frame.data[2]);
  return Error::none;
}

constexpr Error decode_configuration(const CanFrame& frame, FieldSink* sink) {
  const std::uint8_t code = frame.data[0];
  const bool rate = code == configuration::rate;
  if (name_of_configuration(code).empty()) return Error::unsupported;
  if (!is_zero_from(frame, rate ? 3 : 2) || (rate && (frame.data[1] != 0 || !rate_of_index(frame.data[2])))) {
    return Error::out_of_range;
  }
  if (code == configuration::enter && frame.data[1] > 1) return Error::out_of_range;
  if (code == configuration::node && frame.data[1] == 0) return Error::out_of_range;
  if (sink == nullptr) return Error::none;
  put_text(*sink, field_command, name_of_configuration(code));
  if (code == configuration::node) put(*sink, field_new_node, frame.data[1]);
  if (rate) put(*sink, field_bit_rate, rate_of_index(frame.data[2])->bits_per_second);
  return Error::none;
}

// Without a sink only checked.
constexpr Error decode_request(const CanFrame& frame, FieldSink* sink) {
  if (frame.remote) return Error::bad_framing;
  const Function function = function_of(frame);
  if (is_only_named(function)) {
    if (sink != nullptr) put_named(*sink, frame);
    return Error::none;
  }
  if (const Error error = check_shape(frame); error != Error::none) return error;
  if (function == Function::command) return decode_command(frame, sink);
  if (function == Function::configuration) return decode_configuration(frame, sink);
  return Error::unexpected_reply;
}

constexpr Error decode_position_reply(const Format& format, const CanFrame& frame, FieldSink& sink) {
  const Result<std::uint32_t> counts = decode_position(format, frame);
  if (!counts) return counts.error();
  put(sink, field_node, node_of(frame));
  put_position(sink, format, *counts);
  return Error::none;
}

constexpr Error decode_configuration_reply(std::uint8_t code, const CanFrame& frame, FieldSink& sink) {
  if (code != configuration::node && code != configuration::rate) return Error::unexpected_reply;
  const Result<std::uint8_t> answer = decode_configuration_answer(code, frame);
  if (!answer) return answer.error();
  if (*answer != 0) return Error::request_rejected;
  put_text(sink, field_command, name_of_configuration(code));
  return Error::none;
}

// To a command of a node.
constexpr Error decode_answer(const Format& format, const CanFrame& request, const CanFrame& reply, FieldSink& sink) {
  if (reply.id != (0x100u | node_of(request))) return Error::unexpected_reply;
  const std::uint8_t code = request.data[0];
  if (code == command::start || code == command::read) return decode_position_reply(format, reply, sink);
  if (!(reply == encode_answer(node_of(request), code))) return Error::unexpected_reply;
  put(sink, field_node, node_of(request));
  put_text(sink, field_command, name_of_command(code));
  return Error::none;
}

}  // namespace detail

/// Decodes a reply to `request`, or `request` alone when there is no reply; either may be null. Without a request, a
/// frame that a node sends is a position.
constexpr Error decode(const Format& format, const CanFrame* request, const CanFrame* reply, FieldSink& sink) {
  if (reply == nullptr) return request == nullptr ? Error::wrong_length : detail::decode_request(*request, &sink);
  if (reply->remote) return Error::bad_framing;
  const Function function = function_of(*reply);
  if (request == nullptr && is_only_named(function)) {
    detail::put_named(sink, *reply);
    return Error::none;
  }
  if (request != nullptr) {
    if (const Error error = detail::decode_request(*request, nullptr); error != Error::none) return error;
    const Function asked = function_of(*request);
    if (asked == Function::sdo_request && function == Function::sdo_reply && node_of(*request) == node_of(*reply)) {
      detail::put_named(sink, *reply);
      return Error::none;
    }
    if (const Error error = check_shape(*reply); error != Error::none) return error;
    if (asked == Function::command) return detail::decode_answer(format, *request, *reply, sink);
    if (asked == Function::configuration) return detail::decode_configuration_reply(request->data[0], *reply, sink);
    return Error::unexpected_reply;
  }
  if (const Error error = check_shape(*reply); error != Error::none) return error;
  if (function == Function::configuration || function == Function::configuration_reply) {
    return detail::decode_configuration_reply(reply->data[0], *reply, sink);
  }
  return detail::decode_position_reply(format, *reply, sink);
}

}  // namespace absenc::raa38::can
