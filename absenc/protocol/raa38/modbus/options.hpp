// SPDX-License-Identifier: Apache-2.0
// The options of raa38-modbus.
#pragma once

#include <array>
#include <string_view>

#include "absenc/protocol/author/option.hpp"
#include "absenc/protocol/raa38/modbus/frame.hpp"

namespace absenc::raa38::rtu {

namespace choices {
inline constexpr std::array<std::string_view, 3> registers{"auto", "1", "2"};
inline constexpr std::array<std::string_view, bauds.size()> baud{"2400", "4800", "9600", "19200", "57600"};
inline constexpr std::array<std::string_view, 3> reply_data{"four", "three", "three_as_four"};
}  // namespace choices

inline constexpr author::OptionsOf options{
    author::with_role<Role::encoder>(
        author::option<&Format::address>("address", "of the encoder", modbus::first_address, modbus::last_address)),
    author::probeable(author::option<&Format::bits>("bits", "of the position within the turn", 10, 21)),
    author::probeable(author::option<&Format::registers>("registers", "to ask for; auto: one up to 16 bits, two above",
                                                         choices::registers)),
    author::with_role<Role::rate>(author::option<&Format::baud>("baud", "bits a second", choices::baud)),
    author::option<&Format::data>("reply_data",
                                  "virtual encoder: bytes of data for two registers, and how many the byte count says",
                                  choices::reply_data),
};

}  // namespace absenc::raa38::rtu
