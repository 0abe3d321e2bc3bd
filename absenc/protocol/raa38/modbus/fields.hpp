// SPDX-License-Identifier: Apache-2.0
// Names and meanings of everything that an RAA38S6 says over Modbus RTU.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/raa38/modbus/frame.hpp"

namespace absenc::raa38::rtu {

/// In the order in which they are shown.
struct Values {
  std::optional<std::uint16_t> address{};
  std::optional<std::uint16_t> function{};
  std::optional<std::uint16_t> first_register{};
  std::optional<std::uint16_t> registers{};
  std::optional<std::uint32_t> singleturn{};
  std::optional<double> angle{};
  std::optional<std::uint16_t> new_address{};
  std::optional<std::uint16_t> parameter{};
  std::optional<std::string_view> setting{};
  std::optional<std::string_view> crc_order{};
  std::optional<std::uint32_t> baud{};
  std::optional<std::string_view> direction{};
  std::optional<std::string_view> effect{};
  std::optional<bool> written{};
  std::optional<std::uint16_t> encoder_address{};
  std::optional<bool> clash{};
  std::optional<bool> refuses{};
};

inline constexpr auto fields = author::fields_of<Values>(
    author::field<&Values::address>(
        {"address", FieldInfo::Kind::number, "", "address of the encoder", {}, Role::encoder}),
    author::field<&Values::function>({"function", FieldInfo::Kind::number, "", "function code"}),
    author::field<&Values::first_register>({"first_register", FieldInfo::Kind::number, "", "where reading begins"}),
    author::field<&Values::registers>({"registers", FieldInfo::Kind::number, "", "how many are asked for"}),
    author::field<&Values::singleturn>(
        {"singleturn", FieldInfo::Kind::number, "counts", "position within the turn", {}, Role::position}),
    author::field<&Values::angle>(
        {"angle_deg", FieldInfo::Kind::real, "deg", "the same as an angle", {}, Role::of_position}),
    author::field<&Values::new_address>({"new_address", FieldInfo::Kind::number, "", "address from now on"}),
    author::field<&Values::parameter>({"parameter", FieldInfo::Kind::number, "", "what function CC sets"}),
    author::field<&Values::setting>({"setting", FieldInfo::Kind::text, "", "the same in words"}),
    author::field<&Values::crc_order>({"crc_order", FieldInfo::Kind::text, "", "which byte of the CRC comes first"}),
    author::field<&Values::baud>({"baud", FieldInfo::Kind::number, "bit/s", "the baud rate at which it answers"}),
    author::field<&Values::direction>({"direction", FieldInfo::Kind::text, "", "in which direction it counts"}),
    author::field<&Values::effect>({"effect", FieldInfo::Kind::text, "", "what became of the position"}),
    author::field<&Values::written>(
        {"written", FieldInfo::Kind::boolean, "", "whether the setting was sent; it is not where it is so already"}),
    author::field<&Values::encoder_address>(
        {"encoder_address", FieldInfo::Kind::number, "", "address that answers", {}, Role::encoder}),
    author::field<&Values::clash>(
        {"clash", FieldInfo::Kind::boolean, "", "the answer is damaged every time", {}, Role::clash}),
    author::field<&Values::refuses>(
        {"refuses", FieldInfo::Kind::boolean, "", "it answers with an exception: another kind of Modbus slave?"}));

constexpr std::string_view name_of(CrcOrder order) {
  return order == CrcOrder::high_first ? "high_first" : "low_first";
}

constexpr std::string_view name_of_setting(std::uint8_t value) {
  switch (value) {
    case parameter::zero:
      return "zero here";
    case parameter::positive:
      return "positive direction";
    case parameter::negative:
      return "negative direction";
    case 0x24:
      return "2400 baud";
    case 0x48:
      return "4800 baud";
    case 0x96:
      return "9600 baud";
    case 0x19:
      return "19200 baud";
    case 0x57:
      return "57600 baud";
    default:
      return "unknown";
  }
}

constexpr Values values_of(const Request& request) {
  Values values{.function = request.function, .crc_order = name_of(CrcOrder::low_first)};
  if (request.function != function::ask_address) values.address = request.address;
  if (request.function == function::read) {
    values.first_register = request.first_register;
    values.registers = request.registers;
  }
  if (request.function == function::set_address) values.new_address = request.value;
  if (request.function == function::set_parameter) {
    values.parameter = request.value;
    values.setting = name_of_setting(request.value);
  }
  return values;
}

constexpr Values values_of(const Format& format, const Reply& reply) {
  Values values{.function = reply.function, .crc_order = name_of(reply.order)};
  (reply.function == function::set_address ? values.new_address : values.address) = reply.address;
  if (reply.function == function::read) {
    values.singleturn = reply.singleturn;
    values.angle = degrees(reply.singleturn, format.bits);
  }
  if (reply.function == function::set_parameter) {
    values.parameter = reply.value;
    values.setting = name_of_setting(reply.value);
  }
  return values;
}

}  // namespace absenc::raa38::rtu
