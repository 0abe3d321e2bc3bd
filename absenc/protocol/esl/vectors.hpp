// SPDX-License-Identifier: Apache-2.0
// ESL frames with their source. Each is decoded at compile time: a broken frame does not build.
#pragma once

#include <array>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/esl/fields.hpp"
#include "absenc/protocol/esl/settings.hpp"
#include "absenc/protocol/unit.hpp"
#include "absenc/protocol/vector_check.hpp"

namespace absenc::esl {

// clang-format off
namespace expected {
inline constexpr std::array<Expected, 3> v001{{{"data_id", 1}, {"control_field", 8}, {"encoder_address", 0}}};
inline constexpr std::array<Expected, 11> v002{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"singleturn", 11259375}, {"multiturn", 4660}, {"ch1_alarms", 0x00}, {"ch1_sequence", 86}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}, {"ch2_sequence", 86}}};
inline constexpr std::array<Expected, 10> v004{{{"data_id", 2}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"singleturn", 11259375}, {"ch1_alarms", 0x00}, {"ch1_sequence", 86}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}, {"ch2_sequence", 86}}};
inline constexpr std::array<Expected, 5> v006{{{"data_id", 4}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"singleturn", 11259375}, {"multiturn", 4660}}};
inline constexpr std::array<Expected, 3> v007{{{"data_id", 5}, {"control_field", 168}, {"encoder_address", 0}}};
inline constexpr std::array<Expected, 3> v009{{{"data_id", 6}, {"control_field", 176}, {"encoder_address", 0}}};
inline constexpr std::array<Expected, 6> v010{{{"data_id", 6}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"singleturn", 11259375}, {"ch2_status", 0x60}, {"redundant_singleturn", 43981}}};
inline constexpr std::array<Expected, 3> v013{{{"data_id", 9}, {"control_field", 200}, {"encoder_address", 0}}};
inline constexpr std::array<Expected, 4> v014{{{"data_id", 9}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"temperature_c", 37}}};
inline constexpr std::array<Expected, 10> v018{{{"data_id", 11}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"singleturn", 11259375}, {"ch1_alarms", 0x00}, {"ch1_sequence", 86}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}, {"ch2_sequence", 86}}};
inline constexpr std::array<Expected, 3> v019{{{"data_id", 12}, {"control_field", 224}, {"encoder_address", 0}}};
inline constexpr std::array<Expected, 8> v020{{{"data_id", 12}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"singleturn", 11259375}, {"ch1_alarms", 0x00}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}}};
inline constexpr std::array<Expected, 3> v021{{{"data_id", 13}, {"control_field", 104}, {"encoder_address", 0}}};
inline constexpr std::array<Expected, 5> v022{{{"data_id", 13}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"multiturn", 4660}, {"ch1_alarms", 0x00}}};
inline constexpr std::array<Expected, 3> v023{{{"data_id", 5}, {"control_field", 169}, {"encoder_address", 1}}};
inline constexpr std::array<Expected, 3> v024{{{"data_id", 5}, {"control_field", 41}, {"encoder_address", 1}}};
inline constexpr std::array<Expected, 3> v025{{{"data_id", 5}, {"control_field", 168}, {"encoder_address", 0}}};
inline constexpr std::array<Expected, 11> v027{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x0C}, {"singleturn", 0}, {"multiturn", 0}, {"ch1_alarms", 0xFF}, {"ch1_sequence", 0}, {"ch2_status", 0x2C}, {"ch2_alarms", 0xFF}, {"redundant_singleturn", 0}, {"ch2_sequence", 0}}};
inline constexpr std::array<Expected, 6> v028{{{"data_id", 10}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x01}, {"ch2_status", 0x60}, {"ch2_alarms", 0x01}}};
inline constexpr std::array<Expected, 6> v029{{{"data_id", 10}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x02}, {"ch2_status", 0x60}, {"ch2_alarms", 0x02}}};
inline constexpr std::array<Expected, 6> v031{{{"data_id", 10}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x08}, {"ch2_status", 0x60}, {"ch2_alarms", 0x08}}};
inline constexpr std::array<Expected, 6> v032{{{"data_id", 10}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x10}, {"ch2_status", 0x60}, {"ch2_alarms", 0x10}}};
inline constexpr std::array<Expected, 6> v033{{{"data_id", 10}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x20}, {"ch2_status", 0x60}, {"ch2_alarms", 0x20}}};
inline constexpr std::array<Expected, 6> v034{{{"data_id", 10}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x40}, {"ch2_status", 0x60}, {"ch2_alarms", 0x40}}};
inline constexpr std::array<Expected, 6> v035{{{"data_id", 10}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x80}, {"ch2_status", 0x60}, {"ch2_alarms", 0x80}}};
inline constexpr std::array<Expected, 10> v036{{{"data_id", 8}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_sequence", 1}, {"encoder_id", 152}, {"safety", 1}, {"multiturn_bytes", 0}, {"singleturn_bits", 24}, {"ch2_status", 0x60}, {"ch2_sequence", 1}}};
inline constexpr std::array<Expected, 10> v037{{{"data_id", 8}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_sequence", 1}, {"encoder_id", 216}, {"safety", 1}, {"multiturn_bytes", 2}, {"singleturn_bits", 24}, {"ch2_status", 0x60}, {"ch2_sequence", 1}}};
inline constexpr std::array<Expected, 4> v038{{{"data_id", 9}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"temperature_c", -10}}};
inline constexpr std::array<Expected, 5> v039{{{"data_id", 14}, {"encoder_address", 0}, {"memory_address", 26}, {"busy", 0}, {"value", 10}}};
inline constexpr std::array<Expected, 5> v041{{{"data_id", 15}, {"encoder_address", 0}, {"memory_address", 127}, {"busy", 0}, {"value", 4}}};
inline constexpr std::array<Expected, 11> v042{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"singleturn", 11259375}, {"multiturn", 4660}, {"ch1_alarms", 0x00}, {"ch1_sequence", 85}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}, {"ch2_sequence", 85}}};
inline constexpr std::array<Expected, 11> v046{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"singleturn", 11259375}, {"multiturn", 4660}, {"ch1_alarms", 0x00}, {"ch1_sequence", 85}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}, {"ch2_sequence", 85}}};
inline constexpr std::array<Expected, 5> v047{{{"data_id", 14}, {"encoder_address", 0}, {"memory_address", 26}, {"busy", 0}, {"value", 10}}};
inline constexpr std::array<Expected, 11> v054{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"singleturn", 8421376}, {"multiturn", 0}, {"ch1_alarms", 0x00}, {"ch1_sequence", 0}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 256}, {"ch2_sequence", 0}}};
inline constexpr std::array<Expected, 4> v101{{{"data_id", 5}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"singleturn", 11259375}}};
inline constexpr std::array<Expected, 3> v102{{{"data_id", 8}, {"control_field", 64}, {"encoder_address", 0}}};
inline constexpr std::array<Expected, 5> v103{{{"data_id", 15}, {"encoder_address", 0}, {"memory_address", 1}, {"busy", 0}, {"value", 90}}};
inline constexpr std::array<Expected, 5> v104{{{"data_id", 14}, {"encoder_address", 0}, {"memory_address", 1}, {"busy", 1}, {"value", 0}}};
inline constexpr std::array<Expected, 5> v105{{{"data_id", 14}, {"encoder_address", 1}, {"memory_address", 26}, {"busy", 0}, {"value", 10}}};
inline constexpr std::array<Expected, 11> v106{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x00}, {"singleturn", 11259375}, {"multiturn", 4660}, {"ch1_sequence", 85}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}, {"ch2_sequence", 85}}};
inline constexpr std::array<Expected, 11> v107{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x00}, {"singleturn", 11259375}, {"multiturn", 4660}, {"ch1_sequence", 85}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}, {"ch2_sequence", 85}}};
inline constexpr std::array<Expected, 11> v108{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x00}, {"singleturn", 11259375}, {"multiturn", 4660}, {"ch1_sequence", 85}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}, {"ch2_sequence", 85}}};
inline constexpr std::array<Expected, 11> v109{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x00}, {"singleturn", 11259375}, {"multiturn", 4660}, {"ch1_sequence", 85}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}, {"ch2_sequence", 85}}};
inline constexpr std::array<Expected, 11> v110{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x00}, {"singleturn", 11259375}, {"multiturn", 4660}, {"ch1_sequence", 85}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}, {"ch2_sequence", 85}}};
inline constexpr std::array<Expected, 8> v111{{{"data_id", 12}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x00}, {"singleturn", 11259375}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}}};
inline constexpr std::array<Expected, 6> v112{{{"data_id", 6}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"singleturn", 11259375}, {"ch2_status", 0x60}, {"redundant_singleturn", 343}}};
inline constexpr std::array<Expected, 11> v113{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x00}, {"singleturn", 11259375}, {"multiturn", 4660}, {"ch1_sequence", 85}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 343}, {"ch2_sequence", 85}}};
inline constexpr std::array<Expected, 11> v118{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x00}, {"singleturn", 8388608}, {"multiturn", 0}, {"ch1_sequence", 0}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 254}, {"ch2_sequence", 0}}};
inline constexpr std::array<Expected, 11> v119{{{"data_id", 1}, {"encoder_address", 0}, {"ch1_status", 0x40}, {"ch1_alarms", 0x00}, {"singleturn", 0}, {"multiturn", 0}, {"ch1_sequence", 0}, {"ch2_status", 0x60}, {"ch2_alarms", 0x00}, {"redundant_singleturn", 511}, {"ch2_sequence", 0}}};
}  // namespace expected

inline constexpr std::array<Vector, 70> vectors{{
    {"esl-001", "request ID1 EAD0", "derived", "", hex<"0875">, hex<"">, expected::v001},
    {"esl-002", "ID1 nominal", "derived", "", hex<"0875">, hex<"084000efcdab34125646b3086000abd6cd84">, expected::v002},
    {"esl-004", "ID2 nominal", "derived", "", hex<"10ea">, hex<"104000efcdab56a2e2106000abd6d426">, expected::v004},
    {"esl-006", "ID4 nominal", "derived", "", hex<"203d">, hex<"2040efcdab341255">, expected::v006},
    {"esl-007", "request ID5 EAD0", "derived", "", hex<"a8bc">, hex<"">, expected::v007},
    {"esl-009", "request ID6 EAD0", "derived", "", hex<"b023">, hex<"">, expected::v009},
    {"esl-010", "ID6 nominal", "derived", "", hex<"b023">, hex<"b040efcdab25b060abcda7">, expected::v010},
    {"esl-013", "request ID9 EAD0", "derived", "", hex<"c8fb">, hex<"">, expected::v013},
    {"esl-014", "ID9 nominal", "derived", "", hex<"c8fb">, hex<"c84025c4">, expected::v014},
    {"esl-018", "IDB nominal", "derived", "", hex<"58e5">, hex<"584000efcdab56675d586000abd6c4a3">, expected::v018},
    {"esl-019", "request IDC EAD0", "derived", "", hex<"e0b3">, hex<"">, expected::v019},
    {"esl-020", "IDC nominal", "derived", "", hex<"e0b3">, hex<"e04000efcdabd5e06000ab801a">, expected::v020},
    {"esl-021", "request IDD EAD0", "derived", "", hex<"6832">, hex<"">, expected::v021},
    {"esl-022", "IDD nominal", "derived", "", hex<"6832">, hex<"684000341215">, expected::v022},
    {"esl-023", "request ID5 EAD1 parity over CC only", "derived", "", hex<"a97b">, hex<"">, expected::v023},
    {"esl-024", "request ID5 EAD1 parity over EAD+CC", "derived", "parity_scope=all", hex<"298f">, hex<"">, expected::v024},
    {"esl-025", "request ID5 EAD0 without request CRC", "derived", "request_crc=false", hex<"a8">, hex<"">, expected::v025},
    {"esl-027", "ID1 all alarms", "derived", "", hex<"0875">, hex<"080cff0000000000009112082cff00001bbf">, expected::v027},
    {"esl-028", "IDA alarm bit 0 xc", "derived", "", hex<"d064">, hex<"d040013ed0600195">, expected::v028},
    {"esl-029", "IDA alarm bit 1 mt", "derived", "", hex<"d064">, hex<"d040029ed0600235">, expected::v029},
    {"esl-031", "IDA alarm bit 3 overspeed", "derived", "", hex<"d064">, hex<"d040088cd0600827">, expected::v031},
    {"esl-032", "IDA alarm bit 4 mem", "derived", "", hex<"d064">, hex<"d0401013d06010b8">, expected::v032},
    {"esl-033", "IDA alarm bit 5 st", "derived", "", hex<"d064">, hex<"d04020c4d060206f">, expected::v033},
    {"esl-034", "IDA alarm bit 6 uv", "derived", "", hex<"d064">, hex<"d0404083d0604028">, expected::v034},
    {"esl-035", "IDA alarm bit 7 ov", "derived", "", hex<"d064">, hex<"d040800dd06080a6">, expected::v035},
    {"esl-036", "ID8 ST ENID 0x98", "derived", "", hex<"407a">, hex<"4040980150b340609801311b">, expected::v036},
    {"esl-037", "ID8 MT ENID 0xD8", "derived", "", hex<"407a">, hex<"4040d8019f014060d801fea9">, expected::v037},
    {"esl-038", "ID9 -10 C", "derived", "", hex<"c8fb">, hex<"c840f600">, expected::v038},
    {"esl-039", "IDE register read", "derived", "", hex<"7034ac">, hex<"70340a60">, expected::v039},
    {"esl-041", "IDF page select 0x7F <- 4", "derived", "", hex<"f8fe046e">, hex<"f8fe046e">, expected::v041},
    {"esl-042", "ID1 alternate profile: msb, low byte first", "derived", "crc_bit_order=msb", hex<"0857">, hex<"084000efcdab341255277e086000abd57f67">, expected::v042},
    {"esl-046", "ID1 alternate profile: T-format SF/ADF layout", "derived", "status_order=tformat memory_address_order=tformat", hex<"0875">, hex<"080400efcdab3412557cc9080600abd51ea4">, expected::v046},
    {"esl-047", "IDE T-format ADF layout", "derived", "memory_address_order=tformat", hex<"701a4d">, hex<"701a0a14">, expected::v047},
    {"esl-049", "CH2 1-bit error", "derived", "", hex<"0875">, hex<"084000efcdab3412553b5e086000afd5b069">, {}, Error::bad_checksum},
    {"esl-051", "CRC bytes of CH1 swapped", "derived", "", hex<"0875">, hex<"084000efcdab3412555e3b086000abd5b069">, {}, Error::bad_checksum},
    {"esl-052", "CH2 computed with init 0x0000", "derived", "", hex<"0875">, hex<"084000efcdab3412553b5e086000abd57cca">, {}, Error::bad_checksum},
    {"esl-054", "RS off by one is tolerated", "derived", "", hex<"0875">, hex<"084000008080000000ab64086000800025c5">, expected::v054},
    {"esl-101", "ID5", "derived", "", hex<"a8bc">, hex<"a840efcdab61">, expected::v101},
    {"esl-102", "ID8 request", "derived", "", hex<"407a">, hex<"">, expected::v102},
    {"esl-103", "IDF EEPROM write accepted", "document Table 10", "", hex<"f8025af6">, hex<"f8025af6">, expected::v103},
    {"esl-104", "IDE EEPROM busy: EDF 00", "document Table 10", "", hex<"7002d2">, hex<"700300e3">, expected::v104},
    {"esl-105", "IDE with parity over EAD and ID, address 1", "derived", "parity_scope=all address=1", hex<"f134db">, hex<"f1340aa3">, expected::v105},
    {"esl-106", "ID1 crc16_byte_order=high", "derived", "crc16_byte_order=high", hex<"0875">, hex<"084000efcdab3412555e3b086000abd569b0">, expected::v106},
    {"esl-107", "ID1 crc16_byte_order=table12", "derived", "crc16_byte_order=table12", hex<"0875">, hex<"084000efcdab3412553b5e086000abd569b0">, expected::v107},
    {"esl-108", "ID1 crc_bit_order=word", "derived", "crc_bit_order=word", hex<"0857">, hex<"084000efcdab341255afde086000abd5a4be">, expected::v108},
    {"esl-109", "ID1 crc_bit_order=word, high byte first", "derived", "crc_bit_order=word crc16_byte_order=high", hex<"0857">, hex<"084000efcdab341255deaf086000abd5bea4">, expected::v109},
    {"esl-110", "ID1 rs1_sc2=b0", "derived", "rs1_sc2=b0", hex<"0875">, hex<"084000efcdab3412553b5e086000abab1b10">, expected::v110},
    {"esl-111", "IDC idc_rs1=b0", "derived", "idc_rs1=b0", hex<"e0b3">, hex<"e04000efcdabd5e06000ab0129">, expected::v111},
    {"esl-112", "ID6 id6_rs=9", "derived", "id6_rs=9", hex<"b023">, hex<"b040efcdab25b060ab0192">, expected::v112},
    {"esl-113", "ID1 without request CRC", "derived", "request_crc=false", hex<"08">, hex<"084000efcdab3412553b5e086000abd5b069">, expected::v113},
    {"esl-114", "ID1 status_order=tformat read as the document's", "derived", "", hex<"0875">, hex<"080400efcdab3412557cc9080600abd51ea4">, {}, Error::request_rejected},
    {"esl-115", "ID1 rs1_sc2=b0 read as b7", "derived", "", hex<"0875">, hex<"084000efcdab3412553b5e086000ab2bb02c">, {}, Error::sequence_mismatch},
    {"esl-116", "ID1 sequence counters differ", "derived", "", hex<"0875">, hex<"084000efcdab3412553b5e086000abd49b32">, {}, Error::sequence_mismatch},
    {"esl-117", "ID1 redundant position off by two", "derived", "", hex<"0875">, hex<"08400000008000000050f40860007f0092e8">, {}, Error::cross_check_failed},
    {"esl-118", "the same with redundant_tolerance=2", "derived", "redundant_tolerance=2", hex<"0875">, hex<"08400000008000000050f40860007f0092e8">, expected::v118},
    {"esl-119", "ID1 redundant position at the wrap", "derived", "", hex<"0875">, hex<"0840000000000000004a92086000ff803655">, expected::v119},
    {"esl-120", "ID1 without channel 2", "derived", "", hex<"0875">, hex<"084000efcdab3412553b5e">, {}, Error::wrong_length},
    {"esl-121", "ID1 channels swapped", "derived", "", hex<"0875">, hex<"086000abd5b069084000efcdab3412553b5e">, {}, Error::bad_checksum},
    {"esl-122", "ID1 of another encoder", "derived", "", hex<"0875">, hex<"094000efcdab341255341d096000abd5e518">, {}, Error::unexpected_reply},
    {"esl-123", "ID1 channel 2 without its bit", "derived", "", hex<"0875">, hex<"084000efcdab3412553b5e084000abd5acdc">, {}, Error::unexpected_reply},
    {"esl-124", "ID1 channel 1 with the bit of channel 2", "derived", "", hex<"0875">, hex<"086000efcdab3412551742086000abd5b069">, {}, Error::unexpected_reply},
    {"esl-125", "ID1 parity error of the request", "document Table 5", "", hex<"0875">, hex<"084100efcdab3412552b8f086100abd57311">, {}, Error::request_rejected},
    {"esl-126", "ID8 with the bit that is always 0", "derived", "", hex<"407a">, hex<"4040d8019f014060d8816405">, {}, Error::out_of_range},
    {"esl-127", "ID8 two encoder ids", "derived", "", hex<"407a">, hex<"4040d8019f0140609801311b">, {}, Error::cross_check_failed},
    {"esl-128", "IDE of another address", "derived", "", hex<"7034ac">, hex<"70360a49">, {}, Error::unexpected_reply},
    {"esl-129", "IDE busy with data", "derived", "", hex<"7034ac">, hex<"70350a80">, {}, Error::unexpected_reply},
    {"esl-130", "IDC with bits that are always 0", "derived", "", hex<"e0b3">, hex<"e04000efcdabd5e06000ab81dd">, {}, Error::out_of_range},
    {"esl-131", "request with a wrong parity bit", "derived", "", hex<"8881">, hex<"">, {}, Error::bad_checksum},
    {"esl-132", "request with a wrong CRC", "derived", "", hex<"0874">, hex<"">, {}, Error::bad_checksum},
    {"esl-133", "request with an id that Table 3 lacks", "derived", "", hex<"189f">, hex<"">, {}, Error::unsupported},
}};
// clang-format on

namespace detail {

constexpr bool holds(const Vector& vector) {
  VectorCheck check(vector.fields);
  const Error error = decode(to_profile(vector.options), vector.request, vector.reply, check);
  return error == vector.error && check.all();
}

constexpr std::size_t first_that_fails() {
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    if (!holds(vectors[i])) return i;
  }
  return vectors.size();
}
static_assert(first_that_fails() == vectors.size());

}  // namespace detail

}  // namespace absenc::esl
