// SPDX-License-Identifier: Apache-2.0
// The options of raa38-modbus as data, and the format that their values make.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "absenc/protocol/options.hpp"
#include "absenc/protocol/raa38/modbus/device.hpp"

namespace absenc::raa38::rtu {

enum OptionIndex : std::size_t {
  option_address,
  option_bits,
  option_registers,
  option_baud,
  option_reply_data,
};

namespace choices {
inline constexpr std::array<std::string_view, 3> registers{"auto", "1", "2"};
inline constexpr std::array<std::string_view, bauds.size()> baud{"2400", "4800", "9600", "19200", "57600"};
inline constexpr std::array<std::string_view, 3> reply_data{"four", "three", "three_as_four"};
}  // namespace choices

inline constexpr std::array<Option, 5> options{{
    {.name = "address",
     .meaning = "of the encoder",
     .default_value = 1,
     .minimum = modbus::first_address,
     .maximum = modbus::last_address},
    {.name = "bits",
     .meaning = "of the position within the turn",
     .default_value = 14,
     .minimum = 10,
     .maximum = 21,
     .probeable = true},
    {.name = "registers",
     .meaning = "to ask for; auto: one up to 16 bits, two above",
     .default_value = 0,
     .choices = choices::registers,
     .probeable = true},
    {.name = "baud",
     .meaning = "bits a second",
     .default_value = static_cast<std::int64_t>(baud_at_shipping),
     .choices = choices::baud},
    {.name = "reply_data",
     .meaning = "virtual encoder: bytes of data for two registers, and how many the byte count says",
     .default_value = 0,
     .choices = choices::reply_data},
}};
static_assert(options[option_reply_data].name == "reply_data");

[[nodiscard]] constexpr Format to_format(const Options& values) {
  return {.address = static_cast<std::uint8_t>(values[option_address]),
          .bits = static_cast<unsigned>(values[option_bits]),
          .registers = static_cast<unsigned>(values[option_registers]),
          .baud = static_cast<std::size_t>(values[option_baud])};
}

}  // namespace absenc::raa38::rtu
