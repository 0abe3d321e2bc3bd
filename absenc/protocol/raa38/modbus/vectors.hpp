// SPDX-License-Identifier: Apache-2.0
// Modbus RTU frames of the RAA38S6 with their source. Each is decoded when unit.cpp is compiled.
#pragma once

#include <array>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::rtu {

namespace expected {
constexpr Expected low_first{"crc_order", 0, 0, "low_first"};
constexpr Expected high_first{"crc_order", 0, 0, "high_first"};

constexpr std::array<Expected, 5> read_request(std::int64_t registers) {
  return {{{"address", 1}, {"function", 3}, {"first_register", 0}, {"registers", registers}, low_first}};
}
constexpr std::array<Expected, 5> position(std::int64_t singleturn, double angle) {
  return {{{"address", 1}, {"function", 3}, {"singleturn", singleturn}, {"angle_deg", 0, angle}, low_first}};
}
constexpr std::array<Expected, 5> parameter(std::int64_t number, std::string_view setting) {
  return {{{"address", 1}, {"function", 0xCC}, {"parameter", number}, {"setting", 0, 0, setting}, low_first}};
}
inline constexpr auto v001 = read_request(1);
inline constexpr auto v002 = read_request(2);
inline constexpr std::array<Expected, 2> v003{{{"function", 0xA0}, low_first}};
inline constexpr std::array<Expected, 3> v021{{{"address", 1}, {"function", 0xA0}, high_first}};
inline constexpr std::array<Expected, 3> v022{{{"new_address", 2}, {"function", 0xA1}, low_first}};
inline constexpr auto v024 = parameter(0x01, "positive direction");
inline constexpr auto v028 = parameter(0x96, "9600 baud");
inline constexpr auto v029 = parameter(0x19, "19200 baud");
inline constexpr auto v101 = position(383, 8.41552734375);
inline constexpr auto v102 = position(383, 8.41552734375);
inline constexpr auto v103 = position(383, 8.41552734375);
inline constexpr auto v104 = position(0x1FABCD, 356.2998390197754);
inline constexpr auto v105 = position(0x1FABCD, 356.2998390197754);
inline constexpr auto v106 = position(0x1FABCD, 356.2998390197754);
inline constexpr std::array<Expected, 3> v107{{{"address", 1}, {"function", 0xA0}, low_first}};
inline constexpr auto v108 = parameter(0x00, "zero here");
inline constexpr auto v109 = parameter(0x02, "negative direction");
inline constexpr auto v110 = parameter(0x24, "2400 baud");
inline constexpr auto v111 = parameter(0x48, "4800 baud");
inline constexpr auto v112 = parameter(0x57, "57600 baud");
inline constexpr std::array<Expected, 4> v113{{{"address", 1}, {"function", 0xA1}, {"new_address", 2}, low_first}};
}  // namespace expected

// clang-format off
inline constexpr std::array<Vector, 31> vectors{{
    {"raa38-modbus-001", "request of one register", "seed 3.1.7 (5)", "", hex<"010300000001840a">, {}, expected::v001},
    {"raa38-modbus-002", "request of two registers", "seed 3.1.7 (5)", "", hex<"010300000002c40b">, {}, expected::v002},
    {"raa38-modbus-003", "which address?", "seed 3.1.7 (5)", "", hex<"ffa04038">, {}, expected::v003},
    {"raa38-modbus-015", "CRC bytes exchanged", "derived", "bits=14", hex<"010300000001840a">, hex<"010302017f34f8">, {}, Error::bad_checksum},
    {"raa38-modbus-016", "exception 02", "derived", "bits=14", hex<"010300000001840a">, hex<"018302c0f1">, {}, Error::request_rejected},
    {"raa38-modbus-019", "15 bits where there are 14", "derived", "bits=14", hex<"010300000001840a">, hex<"01030240008984">, {}, Error::out_of_range},
    {"raa38-modbus-021", "address 1, high byte of the CRC first", "seed label", "", hex<"ffa04038">, hex<"ffa00130f8">, expected::v021},
    {"raa38-modbus-022", "address 2 from now on", "derived", "", hex<"01a102d851">, hex<"02a1c168">, expected::v022},
    {"raa38-modbus-024", "positive direction", "derived", "", hex<"01cc01b4c0">, hex<"01cc01b4c0">, expected::v024},
    {"raa38-modbus-028", "9600 baud", "derived", "", hex<"01cc96f56e">, hex<"01cc96f56e">, expected::v028},
    {"raa38-modbus-029", "19200 baud", "derived", "", hex<"01cc19b4ca">, hex<"01cc19b4ca">, expected::v029},
    {"raa38-modbus-101", "one register", "derived", "bits=14", hex<"010300000001840a">, hex<"010302017ff834">, expected::v101},
    {"raa38-modbus-102", "two registers, high word 0", "derived", "bits=14 registers=2", hex<"010300000002c40b">, hex<"0103040000017fba43">, expected::v102},
    {"raa38-modbus-103", "three bytes of data, counted as three", "derived", "bits=14 registers=2", hex<"010300000002c40b">, hex<"01030300017f05fe">, expected::v103},
    {"raa38-modbus-104", "21 bits", "derived", "bits=21", hex<"010300000002c40b">, hex<"010304001fabcd7550">, expected::v104},
    {"raa38-modbus-105", "21 bits in three bytes of data", "derived", "bits=21", hex<"010300000002c40b">, hex<"0103031fabcdcaed">, expected::v105},
    {"raa38-modbus-106", "three bytes of data, counted as four", "seed 3.1.7 (5)", "bits=21", hex<"010300000002c40b">, hex<"0103041fabcdcb99">, expected::v106},
    {"raa38-modbus-107", "address 1, low byte of the CRC first", "derived", "", hex<"ffa04038">, hex<"ffa001f830">, expected::v107},
    {"raa38-modbus-108", "zero here", "derived", "", hex<"01cc007500">, hex<"01cc007500">, expected::v108},
    {"raa38-modbus-109", "negative direction", "derived", "", hex<"01cc02f4c1">, hex<"01cc02f4c1">, expected::v109},
    {"raa38-modbus-110", "2400 baud", "derived", "", hex<"01cc24751b">, hex<"01cc24751b">, expected::v110},
    {"raa38-modbus-111", "4800 baud", "derived", "", hex<"01cc487536">, hex<"01cc487536">, expected::v111},
    {"raa38-modbus-112", "57600 baud", "derived", "", hex<"01cc5734fe">, hex<"01cc5734fe">, expected::v112},
    {"raa38-modbus-113", "request of another address", "seed 3.1.7 (5)", "", hex<"01a102d851">, {}, expected::v113},
    {"raa38-modbus-114", "it comes from another address", "derived", "bits=14", hex<"010300000001840a">, hex<"020302017fbc34">, {}, Error::unexpected_reply},
    {"raa38-modbus-115", "it answers another function", "derived", "bits=14", hex<"010300000001840a">, hex<"010402017ff940">, {}, Error::unexpected_reply},
    {"raa38-modbus-116", "two registers where one was asked for", "derived", "bits=14", hex<"010300000001840a">, hex<"0103040000017fba43">, {}, Error::wrong_length},
    {"raa38-modbus-117", "one register where two were asked for", "derived", "bits=21", hex<"010300000002c40b">, hex<"010302017ff834">, {}, Error::wrong_length},
    {"raa38-modbus-118", "byte count 04 with two bytes of data", "derived", "bits=14", hex<"010300000001840a">, hex<"010304017f1835">, {}, Error::wrong_length},
    {"raa38-modbus-119", "exception 01 in reply to A1", "derived", "", hex<"01a102d851">, hex<"01a1019850">, {}, Error::request_rejected},
    {"raa38-modbus-120", "another parameter comes back", "derived", "", hex<"01cc01b4c0">, hex<"01cc02f4c1">, {}, Error::unexpected_reply},
}};
// clang-format on

}  // namespace absenc::raa38::rtu
