// SPDX-License-Identifier: Apache-2.0
// CAN test frames of the RAA38S6 with their source. Each is decoded when unit.cpp is compiled.
#pragma once

#include <array>

#include "absenc/protocol/author/text.hpp"

namespace absenc::raa38::can {

// clang-format off
/// Test frames, each with its source and with the fields or the error that decoding must give.
inline constexpr std::array<author::VectorText, 41> vectors{{
    {"raa38s6-can-001", "seed capture", "seed", "bits=14", "", "1ff:022b000000000000", "node=255 singleturn=11010 angle_deg=241.9189453125"},
    {"raa38s6-can-002", "seed example node 20H 47 26 -> 215.31 deg", "seed", "bits=14", "220:8020000000000000", "120:4726000000000000", "node=32 singleturn=9799 angle_deg=215.31005859375"},
    {"raa38s6-can-003", "21-bit in 3 bytes little-endian", "derived", "bits=21", "", "120:cdab120000000000", "node=32 singleturn=1223629 angle_deg=210.04983901977539"},
    {"raa38s6-can-004", "bad id", "derived", "bits=14", "", "220:4726000000000000", "unexpected_reply"},
    {"raa38s6-can-005", "range", "derived", "bits=14", "", "120:4766000000000000", "out_of_range"},
    {"raa38s6-can-007", "start node FF", "seed", "", "2ff:01ff000000000000", "", "node=255 command=start"},
    {"raa38s6-can-008", "single read node 20", "seed", "", "220:8020000000000000", "", "node=32 command=read"},
    {"raa38s6-can-009", "set zero", "seed", "", "220:2020000000000000", "", "node=32 command=zero"},
    {"raa38s6-can-010", "LSS switch to configuration", "seed", "", "7e5:0401000000000000", "", "command=enter-configuration"},
    {"raa38s6-can-011", "LSS node id 20", "seed", "", "7e5:1120000000000000", "", "command=set-node new_node=32"},
    {"raa38s6-can-012", "LSS bit timing index 3 = 250k", "seed + CiA 305 index", "", "7e5:1300030000000000", "", "command=bitrate bit_rate=250000"},
    {"raa38s6-can-101", "the seed capture asked of another node", "derived", "", "220:8020000000000000", "1ff:022b000000000000", "unexpected_reply"},
    {"raa38s6-can-102", "bit rate 500k", "RAA38S6 manual 3.4.1 (3)", "", "7e5:1300020000000000", "", "command=bitrate bit_rate=500000"},
    {"raa38s6-can-103", "bit rate 1M", "derived", "", "7e5:1300000000000000", "", "command=bitrate bit_rate=1000000"},
    {"raa38s6-can-104", "counting direction", "derived", "", "220:2220010000000000", "", "node=32 command=direction value=1"},
    {"raa38s6-can-105", "10 readings a second", "derived", "", "220:31200a0000000000", "", "node=32 command=cyclic readings_per_s=10"},
    {"raa38s6-can-106", "direction answered: not the position 34", "RAA38S6 manual 3.4.1 (3)", "", "220:2220010000000000", "120:2200000000000000", "node=32 command=direction"},
    {"raa38s6-can-107", "zero answered: not the position 32", "RAA38S6 manual 3.4.1 (3)", "", "220:2020000000000000", "120:2000000000000000", "node=32 command=zero"},
    {"raa38s6-can-108", "cyclic answered: not the position 49", "RAA38S6 manual 3.4.1 (3)", "", "220:3120000000000000", "120:3100000000000000", "node=32 command=cyclic"},
    {"raa38s6-can-109", "the position 32", "derived", "", "220:8020000000000000", "120:2000000000000000", "node=32 singleturn=32 angle_deg=0.703125"},
    {"raa38s6-can-110", "node set", "RAA38S6 manual 3.4.1 (3)", "", "7e5:1120000000000000", "7e5:1100000000000000", "command=set-node"},
    {"raa38s6-can-111", "bit rate set, answered on 7E4", "derived", "", "7e5:1300020000000000", "7e4:1300000000000000", "command=bitrate"},
    {"raa38s6-can-112", "node refused", "derived", "", "7e5:1120000000000000", "7e5:1101000000000000", "request_rejected"},
    {"raa38s6-can-113", "answer to another setting", "derived", "", "7e5:1120000000000000", "7e5:1300000000000000", "unexpected_reply"},
    {"raa38s6-can-114", "a position in place of an answer", "derived", "", "220:2020000000000000", "120:4726000000000000", "unexpected_reply"},
    {"raa38s6-can-115", "seven bytes", "derived", "", "", "120:47260000000000", "wrong_length"},
    {"raa38s6-can-116", "extended identifier", "derived", "", "", "00000120:4726000000000000", "unexpected_reply"},
    {"raa38s6-can-117", "identifier that the table does not have", "derived", "", "", "720:4726000000000000", "unexpected_reply"},
    {"raa38s6-can-118", "a bit in the last byte", "derived", "bits=21", "", "120:cdab120000000080", "out_of_range"},
    {"raa38s6-can-119", "request that names another node", "derived", "", "220:8021000000000000", "", "cross_check_failed"},
    {"raa38s6-can-120", "NMT: start node 20", "CiA 301", "", "", "000:0120", "function=NMT data=\x01\x20"},
    {"raa38s6-can-121", "SYNC", "CiA 301", "", "", "080:", "function=SYNC data="},
    {"raa38s6-can-122", "emergency of node 20", "CiA 301", "", "", "0a0:1081114041424344", "node=32 function=EMCY data=\x10\x81\x11\x40\x41\x42\x43\x44"},
    {"raa38s6-can-123", "SDO of node 20", "CiA 301", "", "", "5a0:4304600141424344", "node=32 function=SDO RX data=\x43\x04\x60\x01\x41\x42\x43\x44"},
    {"raa38s6-can-124", "SDO to node 20", "CiA 301", "", "", "620:4004600141424344", "node=32 function=SDO TX data=\x40\x04\x60\x01\x41\x42\x43\x44"},
    {"raa38s6-can-125", "SDO asked and answered", "CiA 301", "", "620:4004600141424344", "5a0:4304600141424344", "node=32 function=SDO RX data=\x43\x04\x60\x01\x41\x42\x43\x44"},
    {"raa38s6-can-126", "unknown command", "derived", "", "220:7f20000000000000", "", "unsupported"},
    {"raa38s6-can-127", "bit rate that the document lacks", "derived", "", "7e5:1300040000000000", "", "out_of_range"},
    {"raa38s6-can-128", "SYNC in place of a position", "derived", "", "220:8020000000000000", "080:0000000000000000", "unexpected_reply"},
    {"raa38s6-can-129", "what a node sends is no request", "derived", "", "120:4726000000000000", "", "unexpected_reply"},
    {"raa38s6-can-130", "node answer with bits that are always 0", "derived", "", "7e5:1120000000000000", "7e5:1100000000000001", "out_of_range"},
}};
// clang-format on

}  // namespace absenc::raa38::can
