// SPDX-License-Identifier: Apache-2.0
// Modbus RTU test frames of the RAA38S6 with their source.
#pragma once

#include <array>

#include "absenc/protocol/author/text.hpp"

namespace absenc::raa38::rtu {

// clang-format off
/// Test frames, each with its source and with the fields or the error that decoding must give.
inline constexpr std::array<author::VectorText, 31> vectors{{
    {"raa38-modbus-001", "request of one register", "seed 3.1.7 (5)", "", "010300000001840a", "", "address=1 function=3 first_register=0 registers=1 crc_order=low_first"},
    {"raa38-modbus-002", "request of two registers", "seed 3.1.7 (5)", "", "010300000002c40b", "", "address=1 function=3 first_register=0 registers=2 crc_order=low_first"},
    {"raa38-modbus-003", "which address?", "seed 3.1.7 (5)", "", "ffa04038", "", "function=0xA0 crc_order=low_first"},
    {"raa38-modbus-015", "CRC bytes exchanged", "derived", "bits=14", "010300000001840a", "010302017f34f8", "bad_checksum"},
    {"raa38-modbus-016", "exception 02", "derived", "bits=14", "010300000001840a", "018302c0f1", "request_rejected"},
    {"raa38-modbus-019", "15 bits where there are 14", "derived", "bits=14", "010300000001840a", "01030240008984", "out_of_range"},
    {"raa38-modbus-021", "address 1, high byte of the CRC first", "seed label", "", "ffa04038", "ffa00130f8", "address=1 function=0xA0 crc_order=high_first"},
    {"raa38-modbus-022", "address 2 from now on", "derived", "", "01a102d851", "02a1c168", "new_address=2 function=0xA1 crc_order=low_first"},
    {"raa38-modbus-024", "positive direction", "derived", "", "01cc01b4c0", "01cc01b4c0", "address=1 function=0xCC parameter=1 setting=positive direction crc_order=low_first"},
    {"raa38-modbus-028", "9600 baud", "derived", "", "01cc96f56e", "01cc96f56e", "address=1 function=0xCC parameter=150 setting=9600 baud crc_order=low_first"},
    {"raa38-modbus-029", "19200 baud", "derived", "", "01cc19b4ca", "01cc19b4ca", "address=1 function=0xCC parameter=25 setting=19200 baud crc_order=low_first"},
    {"raa38-modbus-101", "one register", "derived", "bits=14", "010300000001840a", "010302017ff834", "address=1 function=3 singleturn=383 angle_deg=8.41552734375 crc_order=low_first"},
    {"raa38-modbus-102", "two registers, high word 0", "derived", "bits=14 registers=2", "010300000002c40b", "0103040000017fba43", "address=1 function=3 singleturn=383 angle_deg=8.41552734375 crc_order=low_first"},
    {"raa38-modbus-103", "three bytes of data, counted as three", "derived", "bits=14 registers=2", "010300000002c40b", "01030300017f05fe", "address=1 function=3 singleturn=383 angle_deg=8.41552734375 crc_order=low_first"},
    {"raa38-modbus-104", "21 bits", "derived", "bits=21", "010300000002c40b", "010304001fabcd7550", "address=1 function=3 singleturn=2075597 angle_deg=356.2998390197754 crc_order=low_first"},
    {"raa38-modbus-105", "21 bits in three bytes of data", "derived", "bits=21", "010300000002c40b", "0103031fabcdcaed", "address=1 function=3 singleturn=2075597 angle_deg=356.2998390197754 crc_order=low_first"},
    {"raa38-modbus-106", "three bytes of data, counted as four", "seed 3.1.7 (5)", "bits=21", "010300000002c40b", "0103041fabcdcb99", "address=1 function=3 singleturn=2075597 angle_deg=356.2998390197754 crc_order=low_first"},
    {"raa38-modbus-107", "address 1, low byte of the CRC first", "derived", "", "ffa04038", "ffa001f830", "address=1 function=0xA0 crc_order=low_first"},
    {"raa38-modbus-108", "zero here", "derived", "", "01cc007500", "01cc007500", "address=1 function=0xCC parameter=0 setting=zero here crc_order=low_first"},
    {"raa38-modbus-109", "negative direction", "derived", "", "01cc02f4c1", "01cc02f4c1", "address=1 function=0xCC parameter=2 setting=negative direction crc_order=low_first"},
    {"raa38-modbus-110", "2400 baud", "derived", "", "01cc24751b", "01cc24751b", "address=1 function=0xCC parameter=36 setting=2400 baud crc_order=low_first"},
    {"raa38-modbus-111", "4800 baud", "derived", "", "01cc487536", "01cc487536", "address=1 function=0xCC parameter=72 setting=4800 baud crc_order=low_first"},
    {"raa38-modbus-112", "57600 baud", "derived", "", "01cc5734fe", "01cc5734fe", "address=1 function=0xCC parameter=87 setting=57600 baud crc_order=low_first"},
    {"raa38-modbus-113", "request of another address", "seed 3.1.7 (5)", "", "01a102d851", "", "address=1 function=0xA1 new_address=2 crc_order=low_first"},
    {"raa38-modbus-114", "it comes from another address", "derived", "bits=14", "010300000001840a", "020302017fbc34", "unexpected_reply"},
    {"raa38-modbus-115", "it answers another function", "derived", "bits=14", "010300000001840a", "010402017ff940", "unexpected_reply"},
    {"raa38-modbus-116", "two registers where one was asked for", "derived", "bits=14", "010300000001840a", "0103040000017fba43", "wrong_length"},
    {"raa38-modbus-117", "one register where two were asked for", "derived", "bits=21", "010300000002c40b", "010302017ff834", "wrong_length"},
    {"raa38-modbus-118", "byte count 04 with two bytes of data", "derived", "bits=14", "010300000001840a", "010304017f1835", "wrong_length"},
    {"raa38-modbus-119", "exception 01 in reply to A1", "derived", "", "01a102d851", "01a1019850", "request_rejected"},
    {"raa38-modbus-120", "another parameter comes back", "derived", "", "01cc01b4c0", "01cc02f4c1", "unexpected_reply"},
}};
// clang-format on

}  // namespace absenc::raa38::rtu
