// SPDX-License-Identifier: Apache-2.0
// Serial frames of the RAA38S6 with their source. Each is decoded when unit.cpp is compiled.
#pragma once

#include <array>

#include "absenc/core/angle.hpp"
#include "absenc/core/hex.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::serial {

namespace expected {
constexpr std::array<Expected, 3> position(std::uint32_t singleturn, unsigned bits, std::uint8_t second_byte = 0x81) {
  return {{{"singleturn", singleturn}, {"second_byte", second_byte}, {"angle_deg", 0, degrees(singleturn, bits)}}};
}
inline constexpr auto v001 = position(383, 14);
inline constexpr auto v002 = position(109517, 17);
inline constexpr auto v003 = position(2097151, 21);
inline constexpr auto v004 = position(1023, 10);
inline constexpr auto v006 = position(16257, 14);
inline constexpr auto v009 = position(383, 14, 0xB2);
inline constexpr std::array<Expected, 2> v010{{{"command", 0, 0, "zero_clear"}, {"unit", 1}}};
inline constexpr auto v015 = position(32513, 16);
inline constexpr std::array<Expected, 2> v102{{{"command", 0, 0, "read"}, {"unit", 10}}};
inline constexpr auto v103 = position(383, 14, 0xB1);
}  // namespace expected

// clang-format off
inline constexpr std::array<Vector, 24> vectors{{
    {"raa38s6-serial-001", "383 of 14 bits", "seed 3.1.1", "bits=14", hex<"">, hex<"ff81017f00">, expected::v001},
    {"raa38s6-serial-002", "17 bits: three data bytes", "derived", "bits=17", hex<"">, hex<"ff8101abcdf9">, expected::v002},
    {"raa38s6-serial-003", "21 bits", "derived", "bits=21", hex<"">, hex<"ff811fffff9d">, expected::v003},
    {"raa38s6-serial-004", "10 bits: still two data bytes", "derived", "bits=10", hex<"">, hex<"ff8103ff82">, expected::v004},
    {"raa38s6-serial-006", "header inside the data", "derived", "bits=14", hex<"">, hex<"ff813f8140">, expected::v006},
    {"raa38s6-serial-008", "bus, form of the tables", "seed 3.1.5", "bits=14", hex<"bcaab1">, hex<"ff81017f00">, expected::v001},
    {"raa38s6-serial-009", "bus, form of the text", "derived from seed 3.1.5", "bits=14", hex<"bcaab2">, hex<"ffb2017f31">, expected::v009},
    {"raa38s6-serial-010", "zero clearing of unit 1", "seed 3.1.6", "", hex<"bcaac1">, hex<"">, expected::v010},
    {"raa38s6-serial-011", "wrong checksum", "derived", "bits=14", hex<"">, hex<"ff81017f01">, {}, Error::bad_checksum},
    {"raa38s6-serial-012", "wrong header", "derived", "bits=14", hex<"">, hex<"ff80017fff">, {}, Error::unexpected_reply},
    {"raa38s6-serial-014", "one byte short", "derived", "bits=14", hex<"">, hex<"ff81017f">, {}, Error::wrong_length},
    {"raa38s6-serial-015", "not seen: swapped data bytes have the same sum", "derived", "bits=16", hex<"">, hex<"ff817f0100">, expected::v015},
    {"raa38s6-serial-102", "request to unit A", "derived from seed 3.1.5", "", hex<"bcaaba">, hex<"">, expected::v102},
    {"raa38s6-serial-103", "bus, asked by the host", "seed 3.1.5", "bits=14 mode=bus", hex<"bcaab1">, hex<"ff81017f00">, expected::v001},
    {"raa38s6-serial-104", "the same with the number", "seed 3.1.5", "bits=14 mode=bus", hex<"bcaab1">, hex<"ffb1017f30">, expected::v103},
    {"raa38s6-serial-105", "another unit answers", "derived", "bits=14 mode=bus", hex<"bcaab1">, hex<"ffb2017f31">, {}, Error::unexpected_reply},
    {"raa38s6-serial-106", "only the number is accepted", "derived", "bits=14 mode=bus second_byte=echo", hex<"bcaab1">, hex<"ff81017f00">, {}, Error::unexpected_reply},
    {"raa38s6-serial-107", "only 81 is accepted", "derived", "bits=14 mode=bus second_byte=81", hex<"bcaab1">, hex<"ffb1017f30">, {}, Error::unexpected_reply},
    {"raa38s6-serial-108", "the 15th bit of 14 is set", "derived", "bits=14", hex<"">, hex<"ff814000c0">, {}, Error::out_of_range},
    {"raa38s6-serial-109", "three data bytes where there must be two", "derived", "bits=16", hex<"">, hex<"ff8101abcdf9">, {}, Error::wrong_length},
    {"raa38s6-serial-110", "two units at once: FF 81 01 7F 00 and FF 81 02 00 82", "derived", "bits=14 mode=bus", hex<"bcaab1">, hex<"ff81000000">, {}, Error::bad_checksum},
    {"raa38s6-serial-111", "nothing answers zero clearing", "derived", "bits=14", hex<"bcaac1">, hex<"ff81017f00">, {}, Error::unexpected_reply},
    {"raa38s6-serial-112", "a request that is none", "derived", "", hex<"bcaad1">, hex<"">, {}, Error::unexpected_reply},
    {"raa38s6-serial-113", "a request that is too short", "derived", "", hex<"bcaa">, hex<"">, {}, Error::wrong_length},
}};
// clang-format on

}  // namespace absenc::raa38::serial
