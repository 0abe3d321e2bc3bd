// SPDX-License-Identifier: Apache-2.0
// CAN frames of the RAA38S6 with their source. Each is decoded when unit.cpp is compiled.
#pragma once

#include <array>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::can {

namespace expected {
inline constexpr std::array<Expected, 3> v001{{{"node", 255}, {"singleturn", 11010}, {"angle_deg", 0, 241.9189453125}}};
inline constexpr std::array<Expected, 3> v002{{{"node", 32}, {"singleturn", 9799}, {"angle_deg", 0, 215.31005859375}}};
inline constexpr std::array<Expected, 3> v003{
    {{"node", 32}, {"singleturn", 1223629}, {"angle_deg", 0, 210.04983901977539}}};
inline constexpr std::array<Expected, 2> v007{{{"node", 255}, {"command", 0, 0, "start"}}};
inline constexpr std::array<Expected, 2> v008{{{"node", 32}, {"command", 0, 0, "read"}}};
inline constexpr std::array<Expected, 2> v009{{{"node", 32}, {"command", 0, 0, "zero"}}};
inline constexpr std::array<Expected, 1> v010{{{"command", 0, 0, "enter-configuration"}}};
inline constexpr std::array<Expected, 2> v011{{{"command", 0, 0, "set-node"}, {"new_node", 32}}};
inline constexpr std::array<Expected, 2> v012{{{"command", 0, 0, "bitrate"}, {"bit_rate", 250'000}}};
inline constexpr std::array<Expected, 2> v102{{{"command", 0, 0, "bitrate"}, {"bit_rate", 500'000}}};
inline constexpr std::array<Expected, 2> v103{{{"command", 0, 0, "bitrate"}, {"bit_rate", 1'000'000}}};
inline constexpr std::array<Expected, 3> v104{{{"node", 32}, {"command", 0, 0, "direction"}, {"value", 1}}};
inline constexpr std::array<Expected, 3> v105{{{"node", 32}, {"command", 0, 0, "cyclic"}, {"readings_per_s", 10}}};
inline constexpr std::array<Expected, 2> v106{{{"node", 32}, {"command", 0, 0, "direction"}}};
inline constexpr std::array<Expected, 2> v107{{{"node", 32}, {"command", 0, 0, "zero"}}};
inline constexpr std::array<Expected, 2> v108{{{"node", 32}, {"command", 0, 0, "cyclic"}}};
inline constexpr std::array<Expected, 3> v109{{{"node", 32}, {"singleturn", 32}, {"angle_deg", 0, 0.703125}}};
inline constexpr std::array<Expected, 1> v110{{{"command", 0, 0, "set-node"}}};
inline constexpr std::array<Expected, 1> v111{{{"command", 0, 0, "bitrate"}}};
inline constexpr std::array<Expected, 2> v120{{{"function", 0, 0, "NMT"}, {"data", 0, 0, "\x01\x20"}}};
inline constexpr std::array<Expected, 2> v121{{{"function", 0, 0, "SYNC"}, {"data", 0, 0, {}}}};
inline constexpr std::array<Expected, 3> v122{
    {{"node", 32}, {"function", 0, 0, "EMCY"}, {"data", 0, 0, "\x10\x81\x11\x40\x41\x42\x43\x44"}}};
inline constexpr std::array<Expected, 3> v123{
    {{"node", 32}, {"function", 0, 0, "SDO RX"}, {"data", 0, 0, "\x43\x04\x60\x01\x41\x42\x43\x44"}}};
inline constexpr std::array<Expected, 3> v124{
    {{"node", 32}, {"function", 0, 0, "SDO TX"}, {"data", 0, 0, "\x40\x04\x60\x01\x41\x42\x43\x44"}}};
}  // namespace expected

// clang-format off
inline constexpr std::array<Vector, 41> vectors{{
    {"raa38s6-can-001", "seed capture", "seed", "bits=14", {}, ascii<"1ff:022b000000000000">, expected::v001},
    {"raa38s6-can-002", "seed example node 20H 47 26 -> 215.31 deg", "seed", "bits=14", ascii<"220:8020000000000000">, ascii<"120:4726000000000000">, expected::v002},
    {"raa38s6-can-003", "21-bit in 3 bytes little-endian", "derived", "bits=21", {}, ascii<"120:cdab120000000000">, expected::v003},
    {"raa38s6-can-004", "bad id", "derived", "bits=14", {}, ascii<"220:4726000000000000">, {}, Error::unexpected_reply},
    {"raa38s6-can-005", "range", "derived", "bits=14", {}, ascii<"120:4766000000000000">, {}, Error::out_of_range},
    {"raa38s6-can-007", "start node FF", "seed", "", ascii<"2ff:01ff000000000000">, {}, expected::v007},
    {"raa38s6-can-008", "single read node 20", "seed", "", ascii<"220:8020000000000000">, {}, expected::v008},
    {"raa38s6-can-009", "set zero", "seed", "", ascii<"220:2020000000000000">, {}, expected::v009},
    {"raa38s6-can-010", "LSS switch to configuration", "seed", "", ascii<"7e5:0401000000000000">, {}, expected::v010},
    {"raa38s6-can-011", "LSS node id 20", "seed", "", ascii<"7e5:1120000000000000">, {}, expected::v011},
    {"raa38s6-can-012", "LSS bit timing index 3 = 250k", "seed + CiA 305 index", "", ascii<"7e5:1300030000000000">, {}, expected::v012},
    {"raa38s6-can-101", "the seed capture asked of another node", "derived", "", ascii<"220:8020000000000000">, ascii<"1ff:022b000000000000">, {}, Error::unexpected_reply},
    {"raa38s6-can-102", "bit rate 500k", "RAA38S6 manual 3.4.1 (3)", "", ascii<"7e5:1300020000000000">, {}, expected::v102},
    {"raa38s6-can-103", "bit rate 1M", "derived", "", ascii<"7e5:1300000000000000">, {}, expected::v103},
    {"raa38s6-can-104", "counting direction", "derived", "", ascii<"220:2220010000000000">, {}, expected::v104},
    {"raa38s6-can-105", "10 readings a second", "derived", "", ascii<"220:31200a0000000000">, {}, expected::v105},
    {"raa38s6-can-106", "direction answered: not the position 34", "RAA38S6 manual 3.4.1 (3)", "", ascii<"220:2220010000000000">, ascii<"120:2200000000000000">, expected::v106},
    {"raa38s6-can-107", "zero answered: not the position 32", "RAA38S6 manual 3.4.1 (3)", "", ascii<"220:2020000000000000">, ascii<"120:2000000000000000">, expected::v107},
    {"raa38s6-can-108", "cyclic answered: not the position 49", "RAA38S6 manual 3.4.1 (3)", "", ascii<"220:3120000000000000">, ascii<"120:3100000000000000">, expected::v108},
    {"raa38s6-can-109", "the position 32", "derived", "", ascii<"220:8020000000000000">, ascii<"120:2000000000000000">, expected::v109},
    {"raa38s6-can-110", "node set", "RAA38S6 manual 3.4.1 (3)", "", ascii<"7e5:1120000000000000">, ascii<"7e5:1100000000000000">, expected::v110},
    {"raa38s6-can-111", "bit rate set, answered on 7E4", "derived", "", ascii<"7e5:1300020000000000">, ascii<"7e4:1300000000000000">, expected::v111},
    {"raa38s6-can-112", "node refused", "derived", "", ascii<"7e5:1120000000000000">, ascii<"7e5:1101000000000000">, {}, Error::request_rejected},
    {"raa38s6-can-113", "answer to another setting", "derived", "", ascii<"7e5:1120000000000000">, ascii<"7e5:1300000000000000">, {}, Error::unexpected_reply},
    {"raa38s6-can-114", "a position in place of an answer", "derived", "", ascii<"220:2020000000000000">, ascii<"120:4726000000000000">, {}, Error::unexpected_reply},
    {"raa38s6-can-115", "seven bytes", "derived", "", {}, ascii<"120:47260000000000">, {}, Error::wrong_length},
    {"raa38s6-can-116", "extended identifier", "derived", "", {}, ascii<"00000120:4726000000000000">, {}, Error::unexpected_reply},
    {"raa38s6-can-117", "identifier that the table does not have", "derived", "", {}, ascii<"720:4726000000000000">, {}, Error::unexpected_reply},
    {"raa38s6-can-118", "a bit in the last byte", "derived", "bits=21", {}, ascii<"120:cdab120000000080">, {}, Error::out_of_range},
    {"raa38s6-can-119", "request that names another node", "derived", "", ascii<"220:8021000000000000">, {}, {}, Error::cross_check_failed},
    {"raa38s6-can-120", "NMT: start node 20", "CiA 301", "", {}, ascii<"000:0120">, expected::v120},
    {"raa38s6-can-121", "SYNC", "CiA 301", "", {}, ascii<"080:">, expected::v121},
    {"raa38s6-can-122", "emergency of node 20", "CiA 301", "", {}, ascii<"0a0:1081114041424344">, expected::v122},
    {"raa38s6-can-123", "SDO of node 20", "CiA 301", "", {}, ascii<"5a0:4304600141424344">, expected::v123},
    {"raa38s6-can-124", "SDO to node 20", "CiA 301", "", {}, ascii<"620:4004600141424344">, expected::v124},
    {"raa38s6-can-125", "SDO asked and answered", "CiA 301", "", ascii<"620:4004600141424344">, ascii<"5a0:4304600141424344">, expected::v123},
    {"raa38s6-can-126", "unknown command", "derived", "", ascii<"220:7f20000000000000">, {}, {}, Error::unsupported},
    {"raa38s6-can-127", "bit rate that the document lacks", "derived", "", ascii<"7e5:1300040000000000">, {}, {}, Error::out_of_range},
    {"raa38s6-can-128", "SYNC in place of a position", "derived", "", ascii<"220:8020000000000000">, ascii<"080:0000000000000000">, {}, Error::unexpected_reply},
    {"raa38s6-can-129", "what a node sends is no request", "derived", "", ascii<"120:4726000000000000">, {}, {}, Error::unexpected_reply},
    {"raa38s6-can-130", "node answer with bits that are always 0", "derived", "", ascii<"7e5:1120000000000000">, ascii<"7e5:1100000000000001">, {}, Error::out_of_range},
}};
// clang-format on

}  // namespace absenc::raa38::can
