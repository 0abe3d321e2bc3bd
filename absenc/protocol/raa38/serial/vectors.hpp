// SPDX-License-Identifier: Apache-2.0
// Serial test frames of the RAA38S6 with their source.
#pragma once

#include <array>

#include "absenc/protocol/author/text.hpp"

namespace absenc::raa38::serial {

// clang-format off
/// Test frames, each with its source and with the fields or the error that decoding must give.
inline constexpr std::array<author::VectorText, 24> vectors{{
    {"raa38s6-serial-001", "383 of 14 bits", "seed 3.1.1", "bits=14", "", "ff81017f00", "singleturn=383 second_byte=129 angle_deg=8.41552734375"},
    {"raa38s6-serial-002", "17 bits: three data bytes", "derived", "bits=17", "", "ff8101abcdf9", "singleturn=109517 second_byte=129 angle_deg=300.79742431640625"},
    {"raa38s6-serial-003", "21 bits", "derived", "bits=21", "", "ff811fffff9d", "singleturn=2097151 second_byte=129 angle_deg=359.99982833862305"},
    {"raa38s6-serial-004", "10 bits: still two data bytes", "derived", "bits=10", "", "ff8103ff82", "singleturn=1023 second_byte=129 angle_deg=359.6484375"},
    {"raa38s6-serial-006", "header inside the data", "derived", "bits=14", "", "ff813f8140", "singleturn=16257 second_byte=129 angle_deg=357.20947265625"},
    {"raa38s6-serial-008", "bus, form of the tables", "seed 3.1.5", "bits=14", "bcaab1", "ff81017f00", "singleturn=383 second_byte=129 angle_deg=8.41552734375"},
    {"raa38s6-serial-009", "bus, form of the text", "derived from seed 3.1.5", "bits=14", "bcaab2", "ffb2017f31", "singleturn=383 second_byte=178 angle_deg=8.41552734375"},
    {"raa38s6-serial-010", "zero clearing of unit 1", "seed 3.1.6", "", "bcaac1", "", "command=zero_clear unit=1"},
    {"raa38s6-serial-011", "wrong checksum", "derived", "bits=14", "", "ff81017f01", "bad_checksum"},
    {"raa38s6-serial-012", "wrong header", "derived", "bits=14", "", "ff80017fff", "unexpected_reply"},
    {"raa38s6-serial-014", "one byte short", "derived", "bits=14", "", "ff81017f", "wrong_length"},
    {"raa38s6-serial-015", "not seen: swapped data bytes have the same sum", "derived", "bits=16", "", "ff817f0100", "singleturn=32513 second_byte=129 angle_deg=178.5992431640625"},
    {"raa38s6-serial-102", "request to unit A", "derived from seed 3.1.5", "", "bcaaba", "", "command=read unit=10"},
    {"raa38s6-serial-103", "bus, asked by the host", "seed 3.1.5", "bits=14 mode=bus", "bcaab1", "ff81017f00", "singleturn=383 second_byte=129 angle_deg=8.41552734375"},
    {"raa38s6-serial-104", "the same with the number", "seed 3.1.5", "bits=14 mode=bus", "bcaab1", "ffb1017f30", "singleturn=383 second_byte=177 angle_deg=8.41552734375"},
    {"raa38s6-serial-105", "another unit answers", "derived", "bits=14 mode=bus", "bcaab1", "ffb2017f31", "unexpected_reply"},
    {"raa38s6-serial-106", "only the number is accepted", "derived", "bits=14 mode=bus second_byte=echo", "bcaab1", "ff81017f00", "unexpected_reply"},
    {"raa38s6-serial-107", "only 81 is accepted", "derived", "bits=14 mode=bus second_byte=81", "bcaab1", "ffb1017f30", "unexpected_reply"},
    {"raa38s6-serial-108", "the 15th bit of 14 is set", "derived", "bits=14", "", "ff814000c0", "out_of_range"},
    {"raa38s6-serial-109", "three data bytes where there must be two", "derived", "bits=16", "", "ff8101abcdf9", "wrong_length"},
    {"raa38s6-serial-110", "two units at once: FF 81 01 7F 00 and FF 81 02 00 82", "derived", "bits=14 mode=bus", "bcaab1", "ff81000000", "bad_checksum"},
    {"raa38s6-serial-111", "nothing answers zero clearing", "derived", "bits=14", "bcaac1", "ff81017f00", "unexpected_reply"},
    {"raa38s6-serial-112", "a request that is none", "derived", "", "bcaad1", "", "unexpected_reply"},
    {"raa38s6-serial-113", "a request that is too short", "derived", "", "bcaa", "", "wrong_length"},
}};
// clang-format on

}  // namespace absenc::raa38::serial
