// SPDX-License-Identifier: Apache-2.0
// Test frames of ESL; the compiler decodes each of them.
#pragma once

#include <array>

#include "absenc/protocol/author/text.hpp"

namespace absenc::esl {

// clang-format off
/// Test vectors of ESL, from the document or derived from it.
inline constexpr std::array vectors{
    author::VectorText{"esl-001", "request ID1 EAD0", "derived", "", "0875", "", "data_id=1 control_field=8 encoder_address=0"},
    author::VectorText{"esl-002", "ID1 nominal", "derived", "", "0875", "084000efcdab34125646b3086000abd6cd84", "data_id=1 encoder_address=0 ch1_status=0x40 singleturn=11259375 multiturn=4660 ch1_alarms=0x00 ch1_sequence=86 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343 ch2_sequence=86"},
    author::VectorText{"esl-004", "ID2 nominal", "derived", "", "10ea", "104000efcdab56a2e2106000abd6d426", "data_id=2 encoder_address=0 ch1_status=0x40 singleturn=11259375 ch1_alarms=0x00 ch1_sequence=86 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343 ch2_sequence=86"},
    author::VectorText{"esl-006", "ID4 nominal", "derived", "", "203d", "2040efcdab341255", "data_id=4 encoder_address=0 ch1_status=0x40 singleturn=11259375 multiturn=4660"},
    author::VectorText{"esl-007", "request ID5 EAD0", "derived", "", "a8bc", "", "data_id=5 control_field=168 encoder_address=0"},
    author::VectorText{"esl-009", "request ID6 EAD0", "derived", "", "b023", "", "data_id=6 control_field=176 encoder_address=0"},
    author::VectorText{"esl-010", "ID6 nominal", "derived", "", "b023", "b040efcdab25b060abcda7", "data_id=6 encoder_address=0 ch1_status=0x40 singleturn=11259375 ch2_status=0x60 redundant_singleturn=43981"},
    author::VectorText{"esl-013", "request ID9 EAD0", "derived", "", "c8fb", "", "data_id=9 control_field=200 encoder_address=0"},
    author::VectorText{"esl-014", "ID9 nominal", "derived", "", "c8fb", "c84025c4", "data_id=9 encoder_address=0 ch1_status=0x40 temperature_c=37"},
    author::VectorText{"esl-018", "IDB nominal", "derived", "", "58e5", "584000efcdab56675d586000abd6c4a3", "data_id=11 encoder_address=0 ch1_status=0x40 singleturn=11259375 ch1_alarms=0x00 ch1_sequence=86 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343 ch2_sequence=86"},
    author::VectorText{"esl-019", "request IDC EAD0", "derived", "", "e0b3", "", "data_id=12 control_field=224 encoder_address=0"},
    author::VectorText{"esl-020", "IDC nominal", "derived", "", "e0b3", "e04000efcdabd5e06000ab801a", "data_id=12 encoder_address=0 ch1_status=0x40 singleturn=11259375 ch1_alarms=0x00 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343"},
    author::VectorText{"esl-021", "request IDD EAD0", "derived", "", "6832", "", "data_id=13 control_field=104 encoder_address=0"},
    author::VectorText{"esl-022", "IDD nominal", "derived", "", "6832", "684000341215", "data_id=13 encoder_address=0 ch1_status=0x40 multiturn=4660 ch1_alarms=0x00"},
    author::VectorText{"esl-023", "request ID5 EAD1 parity over CC only", "derived", "", "a97b", "", "data_id=5 control_field=169 encoder_address=1"},
    author::VectorText{"esl-024", "request ID5 EAD1 parity over EAD+CC", "derived", "parity_scope=all", "298f", "", "data_id=5 control_field=41 encoder_address=1"},
    author::VectorText{"esl-025", "request ID5 EAD0 without request CRC", "derived", "request_crc=false", "a8", "", "data_id=5 control_field=168 encoder_address=0"},
    author::VectorText{"esl-027", "ID1 all alarms", "derived", "", "0875", "080cff0000000000009112082cff00001bbf", "data_id=1 encoder_address=0 ch1_status=0x0C singleturn=0 multiturn=0 ch1_alarms=0xFF ch1_sequence=0 ch2_status=0x2C ch2_alarms=0xFF redundant_singleturn=0 ch2_sequence=0"},
    author::VectorText{"esl-028", "IDA alarm bit 0 xc", "derived", "", "d064", "d040013ed0600195", "data_id=10 encoder_address=0 ch1_status=0x40 ch1_alarms=0x01 ch2_status=0x60 ch2_alarms=0x01"},
    author::VectorText{"esl-029", "IDA alarm bit 1 mt", "derived", "", "d064", "d040029ed0600235", "data_id=10 encoder_address=0 ch1_status=0x40 ch1_alarms=0x02 ch2_status=0x60 ch2_alarms=0x02"},
    author::VectorText{"esl-031", "IDA alarm bit 3 overspeed", "derived", "", "d064", "d040088cd0600827", "data_id=10 encoder_address=0 ch1_status=0x40 ch1_alarms=0x08 ch2_status=0x60 ch2_alarms=0x08"},
    author::VectorText{"esl-032", "IDA alarm bit 4 mem", "derived", "", "d064", "d0401013d06010b8", "data_id=10 encoder_address=0 ch1_status=0x40 ch1_alarms=0x10 ch2_status=0x60 ch2_alarms=0x10"},
    author::VectorText{"esl-033", "IDA alarm bit 5 st", "derived", "", "d064", "d04020c4d060206f", "data_id=10 encoder_address=0 ch1_status=0x40 ch1_alarms=0x20 ch2_status=0x60 ch2_alarms=0x20"},
    author::VectorText{"esl-034", "IDA alarm bit 6 uv", "derived", "", "d064", "d0404083d0604028", "data_id=10 encoder_address=0 ch1_status=0x40 ch1_alarms=0x40 ch2_status=0x60 ch2_alarms=0x40"},
    author::VectorText{"esl-035", "IDA alarm bit 7 ov", "derived", "", "d064", "d040800dd06080a6", "data_id=10 encoder_address=0 ch1_status=0x40 ch1_alarms=0x80 ch2_status=0x60 ch2_alarms=0x80"},
    author::VectorText{"esl-036", "ID8 ST ENID 0x98", "derived", "turns=false", "407a", "4040980150b340609801311b", "data_id=8 encoder_address=0 ch1_status=0x40 ch1_sequence=1 encoder_id=152 safety=1 multiturn_bytes=0 singleturn_bits=24 ch2_status=0x60 ch2_sequence=1"},
    author::VectorText{"esl-037", "ID8 MT ENID 0xD8", "derived", "", "407a", "4040d8019f014060d801fea9", "data_id=8 encoder_address=0 ch1_status=0x40 ch1_sequence=1 encoder_id=216 safety=1 multiturn_bytes=2 singleturn_bits=24 ch2_status=0x60 ch2_sequence=1"},
    author::VectorText{"esl-038", "ID9 -10 C", "derived", "", "c8fb", "c840f600", "data_id=9 encoder_address=0 ch1_status=0x40 temperature_c=-10"},
    author::VectorText{"esl-039", "IDE register read", "derived", "", "7034ac", "70340a60", "data_id=14 encoder_address=0 memory_address=26 busy=0 value=10"},
    author::VectorText{"esl-041", "IDF page select 0x7F <- 4", "derived", "", "f8fe046e", "f8fe046e", "data_id=15 encoder_address=0 memory_address=127 busy=0 value=4"},
    author::VectorText{"esl-042", "ID1 alternate profile: msb, low byte first", "derived", "crc_bit_order=msb", "0857", "084000efcdab341255277e086000abd57f67", "data_id=1 encoder_address=0 ch1_status=0x40 singleturn=11259375 multiturn=4660 ch1_alarms=0x00 ch1_sequence=85 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343 ch2_sequence=85"},
    author::VectorText{"esl-046", "ID1 alternate profile: T-format SF/ADF layout", "derived", "status_order=tformat memory_address_order=tformat", "0875", "080400efcdab3412557cc9080600abd51ea4", "data_id=1 encoder_address=0 ch1_status=0x40 singleturn=11259375 multiturn=4660 ch1_alarms=0x00 ch1_sequence=85 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343 ch2_sequence=85"},
    author::VectorText{"esl-047", "IDE T-format ADF layout", "derived", "memory_address_order=tformat", "701a4d", "701a0a14", "data_id=14 encoder_address=0 memory_address=26 busy=0 value=10"},
    author::VectorText{"esl-049", "CH2 1-bit error", "derived", "", "0875", "084000efcdab3412553b5e086000afd5b069", "bad_checksum"},
    author::VectorText{"esl-051", "CRC bytes of CH1 swapped", "derived", "", "0875", "084000efcdab3412555e3b086000abd5b069", "bad_checksum"},
    author::VectorText{"esl-052", "CH2 computed with init 0x0000", "derived", "", "0875", "084000efcdab3412553b5e086000abd57cca", "bad_checksum"},
    author::VectorText{"esl-054", "RS off by one is tolerated", "derived", "", "0875", "084000008080000000ab64086000800025c5", "data_id=1 encoder_address=0 ch1_status=0x40 singleturn=8421376 multiturn=0 ch1_alarms=0x00 ch1_sequence=0 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=256 ch2_sequence=0"},
    author::VectorText{"esl-101", "ID5", "derived", "", "a8bc", "a840efcdab61", "data_id=5 encoder_address=0 ch1_status=0x40 singleturn=11259375"},
    author::VectorText{"esl-102", "ID8 request", "derived", "", "407a", "", "data_id=8 control_field=64 encoder_address=0"},
    author::VectorText{"esl-103", "IDF EEPROM write accepted", "document Table 10", "", "f8025af6", "f8025af6", "data_id=15 encoder_address=0 memory_address=1 busy=0 value=90"},
    author::VectorText{"esl-104", "IDE EEPROM busy: EDF 00", "document Table 10", "", "7002d2", "700300e3", "data_id=14 encoder_address=0 memory_address=1 busy=1 value=0"},
    author::VectorText{"esl-105", "IDE with parity over EAD and ID, address 1", "derived", "parity_scope=all address=1", "f134db", "f1340aa3", "data_id=14 encoder_address=1 memory_address=26 busy=0 value=10"},
    author::VectorText{"esl-106", "ID1 crc16_byte_order=high", "derived", "crc16_byte_order=high", "0875", "084000efcdab3412555e3b086000abd569b0", "data_id=1 encoder_address=0 ch1_status=0x40 ch1_alarms=0x00 singleturn=11259375 multiturn=4660 ch1_sequence=85 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343 ch2_sequence=85"},
    author::VectorText{"esl-107", "ID1 crc16_byte_order=table12", "derived", "crc16_byte_order=table12", "0875", "084000efcdab3412553b5e086000abd569b0", "data_id=1 encoder_address=0 ch1_status=0x40 ch1_alarms=0x00 singleturn=11259375 multiturn=4660 ch1_sequence=85 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343 ch2_sequence=85"},
    author::VectorText{"esl-108", "ID1 crc_bit_order=word", "derived", "crc_bit_order=word", "0857", "084000efcdab341255afde086000abd5a4be", "data_id=1 encoder_address=0 ch1_status=0x40 ch1_alarms=0x00 singleturn=11259375 multiturn=4660 ch1_sequence=85 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343 ch2_sequence=85"},
    author::VectorText{"esl-109", "ID1 crc_bit_order=word, high byte first", "derived", "crc_bit_order=word crc16_byte_order=high", "0857", "084000efcdab341255deaf086000abd5bea4", "data_id=1 encoder_address=0 ch1_status=0x40 ch1_alarms=0x00 singleturn=11259375 multiturn=4660 ch1_sequence=85 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343 ch2_sequence=85"},
    author::VectorText{"esl-110", "ID1 rs1_sc2=b0", "derived", "rs1_sc2=b0", "0875", "084000efcdab3412553b5e086000abab1b10", "data_id=1 encoder_address=0 ch1_status=0x40 ch1_alarms=0x00 singleturn=11259375 multiturn=4660 ch1_sequence=85 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343 ch2_sequence=85"},
    author::VectorText{"esl-111", "IDC idc_rs1=b0", "derived", "idc_rs1=b0", "e0b3", "e04000efcdabd5e06000ab0129", "data_id=12 encoder_address=0 ch1_status=0x40 ch1_alarms=0x00 singleturn=11259375 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343"},
    author::VectorText{"esl-112", "ID6 id6_rs=9", "derived", "id6_rs=9", "b023", "b040efcdab25b060ab0192", "data_id=6 encoder_address=0 ch1_status=0x40 singleturn=11259375 ch2_status=0x60 redundant_singleturn=343"},
    author::VectorText{"esl-113", "ID1 without request CRC", "derived", "request_crc=false", "08", "084000efcdab3412553b5e086000abd5b069", "data_id=1 encoder_address=0 ch1_status=0x40 ch1_alarms=0x00 singleturn=11259375 multiturn=4660 ch1_sequence=85 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=343 ch2_sequence=85"},
    author::VectorText{"esl-114", "ID1 status_order=tformat read as the document's", "derived", "", "0875", "080400efcdab3412557cc9080600abd51ea4", "request_rejected"},
    author::VectorText{"esl-115", "ID1 rs1_sc2=b0 read as b7", "derived", "", "0875", "084000efcdab3412553b5e086000ab2bb02c", "sequence_mismatch"},
    author::VectorText{"esl-116", "ID1 sequence counters differ", "derived", "", "0875", "084000efcdab3412553b5e086000abd49b32", "sequence_mismatch"},
    author::VectorText{"esl-117", "ID1 redundant position off by two", "derived", "", "0875", "08400000008000000050f40860007f0092e8", "cross_check_failed"},
    author::VectorText{"esl-118", "the same with redundant_tolerance=2", "derived", "redundant_tolerance=2", "0875", "08400000008000000050f40860007f0092e8", "data_id=1 encoder_address=0 ch1_status=0x40 ch1_alarms=0x00 singleturn=8388608 multiturn=0 ch1_sequence=0 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=254 ch2_sequence=0"},
    author::VectorText{"esl-119", "ID1 redundant position at the wrap", "derived", "", "0875", "0840000000000000004a92086000ff803655", "data_id=1 encoder_address=0 ch1_status=0x40 ch1_alarms=0x00 singleturn=0 multiturn=0 ch1_sequence=0 ch2_status=0x60 ch2_alarms=0x00 redundant_singleturn=511 ch2_sequence=0"},
    author::VectorText{"esl-120", "ID1 without channel 2", "derived", "", "0875", "084000efcdab3412553b5e", "wrong_length"},
    author::VectorText{"esl-121", "ID1 channels swapped", "derived", "", "0875", "086000abd5b069084000efcdab3412553b5e", "bad_checksum"},
    author::VectorText{"esl-122", "ID1 of another encoder", "derived", "", "0875", "094000efcdab341255341d096000abd5e518", "unexpected_reply"},
    author::VectorText{"esl-123", "ID1 channel 2 without its bit", "derived", "", "0875", "084000efcdab3412553b5e084000abd5acdc", "unexpected_reply"},
    author::VectorText{"esl-124", "ID1 channel 1 with the bit of channel 2", "derived", "", "0875", "086000efcdab3412551742086000abd5b069", "unexpected_reply"},
    author::VectorText{"esl-125", "ID1 parity error of the request", "document Table 5", "", "0875", "084100efcdab3412552b8f086100abd57311", "request_rejected"},
    author::VectorText{"esl-126", "ID8 with the bit that is always 0", "derived", "", "407a", "4040d8019f014060d8816405", "out_of_range"},
    author::VectorText{"esl-127", "ID8 two encoder ids", "derived", "", "407a", "4040d8019f0140609801311b", "cross_check_failed"},
    author::VectorText{"esl-128", "IDE of another address", "derived", "", "7034ac", "70360a49", "unexpected_reply"},
    author::VectorText{"esl-129", "IDE busy with data", "derived", "", "7034ac", "70350a80", "unexpected_reply"},
    author::VectorText{"esl-130", "IDC with bits that are always 0", "derived", "", "e0b3", "e04000efcdabd5e06000ab81dd", "out_of_range"},
    author::VectorText{"esl-131", "request with a wrong parity bit", "derived", "", "8881", "", "bad_checksum"},
    author::VectorText{"esl-132", "request with a wrong CRC", "derived", "", "0874", "", "bad_checksum"},
    author::VectorText{"esl-134", "request with the busy bit", "derived", "", "70356b", "", "out_of_range"},
    author::VectorText{"esl-135", "ID2 answered as ID B", "derived", "", "10ea", "584000efcdab56675d586000abd6c4a3", "unexpected_reply"},
    author::VectorText{"esl-133", "request with an id that Table 3 lacks", "derived", "", "189f", "", "unsupported"},
};
// clang-format on

}  // namespace absenc::esl
