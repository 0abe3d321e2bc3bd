// SPDX-License-Identifier: Apache-2.0
// Names and meanings of what the RAA38S6 says on asynchronous lines.
#pragma once

#include <optional>
#include <string_view>

#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/raa38/serial/frame.hpp"

namespace absenc::raa38::serial {

/// In the order in which they are shown.
struct Values {
  std::optional<std::uint8_t> encoder_address{};
  std::optional<bool> clash{};
  std::optional<std::uint32_t> before{};
  std::optional<std::uint32_t> singleturn{};
  std::optional<std::uint8_t> second_byte{};
  std::optional<double> angle{};
  std::optional<std::string_view> command{};
  std::optional<std::uint8_t> unit{};
  std::optional<std::uint64_t> skipped{};
};

using enum FieldInfo::Kind;
inline constexpr auto fields = author::fields_of<Values>(
    author::field<&Values::encoder_address>({"encoder_address", number, "", "the number behind B", {}, Role::encoder}),
    author::field<&Values::clash>(
        {"clash", boolean, "", "every answer is damaged: two encoders, or a bad line", {}, Role::clash}),
    author::field<&Values::before>({"before", number, "counts", "position before the zero was set"}),
    author::field<&Values::singleturn>(
        {"singleturn", number, "counts", "position within the turn", {}, Role::position}),
    author::field<&Values::second_byte>({"second_byte", number, "", "81, or on a bus Bx: the encoder's number"}),
    author::field<&Values::angle>({"angle_deg", real, "deg", "the same as an angle", {}, Role::of_position}),
    author::field<&Values::command>({"command", text, "", "read or zero_clear"}),
    author::field<&Values::unit>({"unit", number, "", "the number behind B or C"}),
    author::field<&Values::skipped>({"skipped", number, "bytes", "so far, that belonged to no good frame"}));

constexpr Values values_of(const Format& format, const Position& position) {
  return {.singleturn = position.singleturn,
          .second_byte = position.second_byte,
          .angle = degrees(position.singleturn, format.bits)};
}

constexpr Values values_of(const Request& request) {
  return {.command = request.kind == Request::Kind::read ? "read" : "zero_clear", .unit = request.unit};
}

}  // namespace absenc::raa38::serial
